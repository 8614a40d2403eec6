"""The robot's side of a camera network: announces stops, collects what the cameras saw, records all, knows who lives.

What arrives is put into a queue by Zenoh's threads and worked off by one loop: decode, record, tell new from repeated,
hand on. Once a second the loop asks the senders for what is missing; nodes tell in their health how much there is. At
the end it waits until nothing is missing from those who are alive, `PATIENCE` seconds at most.
"""

from __future__ import annotations

import itertools
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from groma.errors import UserError
from groma.io.camera_protocol import (
    Again,
    Detections,
    Health,
    Numbered,
    Odometry,
    Stop,
    ask_key,
    data_key,
    decode,
    encode,
    health_key,
    key,
)
from groma.io.link_recording import Recorder
from groma.link.collector import Collector, Tally
from groma.link.node import ROBOT
from groma.link.standstill import Standstill

if TYPE_CHECKING:
    import zenoh

ASK_PERIOD = 1.0
"""Time between two rounds of requests [s]."""
ANSWER_TIME = 2.0
"""How long an answer may take [s]."""
REQUESTS_A_ROUND = 50
LAST_SIGNS = 2.0
"""At the end, time for each node to tell once more how much there is [s]."""
PATIENCE = 10.0
"""How long missing messages are waited for at the end [s]."""
BURST = 3
"""Images that each camera takes at a stop."""


@dataclass(frozen=True, slots=True)
class Peer:
    """What is known of a sender."""

    alive: bool
    tally: Tally
    health: Health | None
    last: float
    """Arrival of its last sign [s]; 0: none."""


@dataclass
class Survey:
    """Collect a network's messages until it is stopped."""

    session: zenoh.Session
    site: str
    boot: str
    recorder: Recorder
    fresh: Callable[[Numbered], None] = lambda _: None
    """Takes each new numbered message, once, in the order of arrival."""
    report: Callable[[str], None] = lambda _: None
    """Takes lines for a person."""
    stop: int | None = None
    """The stop that lasts."""
    _inbox: queue.Queue[tuple[str, bytes, float]] = field(default_factory=queue.Queue)
    _collector: Collector = field(default_factory=Collector)
    _standstill: Standstill = field(default_factory=Standstill)
    _alive: set[tuple[str, str]] = field(default_factory=set)
    _health: dict[str, Health] = field(default_factory=dict)
    _last: dict[str, float] = field(default_factory=dict)
    _stops: int = 0
    _sequence: int = 0
    _announced: bytes = b""
    _refused: int = 0

    def run(self, end: threading.Event) -> None:
        """Collect until `end` is set, then until nothing is missing or patience ends."""
        listen = self.session.declare_subscriber
        with (
            listen(data_key(self.site, "*"), self._arrived),
            listen(health_key(self.site, "*"), self._arrived),
            self.session.liveliness().declare_subscriber(key(self.site, "alive", "*", "*"), self._sign, history=True),
        ):
            self._collect(end.is_set)
            ended = time.monotonic()
            self._collect(lambda: time.monotonic() > ended + LAST_SIGNS)
            self._collect(lambda: time.monotonic() > ended + PATIENCE or not self._awaited())

    def peers(self) -> dict[str, Peer]:
        """Return all senders that were heard of, by name."""
        alive = {sender for sender, _ in self._alive.copy()}
        tallies = self._collector.tallies()
        names = alive | tallies.keys() | self._health.keys()
        return {
            name: Peer(name in alive, tallies.get(name, Tally()), self._health.get(name), self._last.get(name, 0.0))
            for name in sorted(names)
        }

    @property
    def refused(self) -> int:
        """Messages that were not of this protocol."""
        return self._refused

    def _collect(self, done: Callable[[], bool]) -> None:
        next_round = time.monotonic()
        while not done():
            if time.monotonic() >= next_round:
                self._ask()
                self._repeat()
                next_round = time.monotonic() + ASK_PERIOD
            try:
                self._take(*self._inbox.get(timeout=0.1))
            except queue.Empty:
                continue

    def _awaited(self) -> int:
        """Return the number of messages that are missing or unread and may still come."""
        peers = self.peers().values()
        return self._inbox.qsize() + sum(peer.tally.missing for peer in peers if peer.alive)

    def _take(self, topic: str, data: bytes, arrival: float) -> None:
        try:
            message = decode(data, topic)
        except UserError as error:
            self._refused += 1
            self.report(str(error))
            return
        self.recorder.write(topic, message, data, arrival)
        if isinstance(message, Health):
            self._last[message.sender] = arrival
            self._health[message.sender] = message
            self._collector.announce(message.sender, message.counts, message.boot)
        elif isinstance(message, Detections | Odometry | Stop):
            self._last[message.sender] = arrival
            if self._collector.take(message):
                self._new(message)

    def _new(self, message: Numbered) -> None:
        self.fresh(message)
        if isinstance(message, Odometry):
            standing = self._standstill.take(message)
            if standing != (self.stop is not None):
                self._announce(standing, message.stamp)

    def _announce(self, standing: bool, stamp: float) -> None:
        """Tell the cameras, and everybody who records, that the robot stands or goes on; through the same door."""
        if standing:
            self.stop, self._stops = self._stops, self._stops + 1
        number = self.stop if self.stop is not None else 0
        if not standing:
            self.stop = None
        message = Stop(
            sender=ROBOT,
            boot=self.boot,
            sequence=self._sequence,
            stop=number,
            stamp=stamp,
            standing=standing,
            burst=BURST,
        )
        self._sequence += 1
        self._announced = encode(message)
        self._repeat()

    def _repeat(self) -> None:
        """Say again what holds, for those who came late or missed it; it keeps its number."""
        if self._announced:
            self.session.put(data_key(self.site, ROBOT), self._announced)

    def _ask(self) -> None:
        for sender, request in itertools.islice(self._collector.requests(), REQUESTS_A_ROUND):
            if any(name == sender for name, _ in self._alive.copy()):
                self._ask_one(sender, request)

    def _ask_one(self, sender: str, request: Again) -> None:
        topic = data_key(self.site, sender)

        def answered(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                for line in reply.ok.payload.to_bytes().splitlines():
                    self._inbox.put((topic, line, time.time()))

        self.session.get(ask_key(self.site, sender), answered, payload=encode(request), timeout=ANSWER_TIME)

    def _arrived(self, sample: zenoh.Sample) -> None:
        self._inbox.put((str(sample.key_expr), sample.payload.to_bytes(), time.time()))

    def _sign(self, sample: zenoh.Sample) -> None:
        import zenoh

        _, sender, boot = str(sample.key_expr).rsplit("/", 2)
        if sample.kind == zenoh.SampleKind.PUT:
            self._alive.add((sender, boot))
        else:
            self._alive.discard((sender, boot))

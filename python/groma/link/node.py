"""A camera node: takes images when the robot stands (and at a rate, if wanted), detects, and publishes what it saw.

Images stay at the node; they travel only when one is requested. Each message is kept in the node's journal before it is
sent. So whatever is lost on the way, or while nobody listened, or by a crash of the node, can be requested again.
"""

from __future__ import annotations

import io
import os
import queue
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from PIL import Image

from groma.errors import UserError
from groma.io.camera_protocol import (
    Again,
    Corners,
    Detections,
    Health,
    Picture,
    Stop,
    alive_key,
    ask_key,
    data_key,
    decode,
    encode,
    health_key,
)
from groma.link.journal import Journal
from groma.link.sources import Grey, Source

if TYPE_CHECKING:
    import zenoh

Detect = Callable[[Grey], tuple[tuple[Corners, ...], int]]
"""From an image to the corners seen on each panel, and the count of tags that were left out."""

HEALTH_PERIOD = 1.0
"""Time between two signs of life [s]."""
IMAGES_KEPT = 32
"""Newest images that can be requested."""
CLOCK_SIGMA = 0.01
"""How far a clock kept by NTP may be off [s]."""
ROBOT = "survey"
"""Who announces the stops."""


def new_boot() -> str:
    """Return a name for a start of a program: sorts by time, and two starts do not share one."""
    return f"{time.time_ns():020d}-{os.getpid():x}"


@dataclass
class Node:
    """One camera on the network; `run` works until it is stopped."""

    session: zenoh.Session
    site: str
    camera: str
    source: Source
    detect: Detect
    journal: Journal
    boot: str
    rate: float = 0.0
    """Images each second beside those at stops; 0: none."""
    report: Callable[[str], None] = lambda _: None
    """Takes lines for a person."""
    _stops: queue.Queue[Stop] = field(default_factory=queue.Queue)
    _images: OrderedDict[int, Grey] = field(default_factory=OrderedDict)
    _last_stop: tuple[str, int] = ("", -1)
    """Boot and sequence of the newest announcement: one that comes again, or too late, is passed over."""
    _here: Stop | None = None
    """The stop that lasts."""
    _frames: int = 0
    _sequence: int = 0
    _size: tuple[int, int] = (0, 0)
    _trouble: str = ""
    _ended: bool = False
    """The source has no image any more."""

    def run(self, end: threading.Event) -> None:
        """Take, detect and publish until `end` is set."""
        with (
            self.session.liveliness().declare_token(alive_key(self.site, self.camera, self.boot)),
            self.session.declare_subscriber(data_key(self.site, ROBOT), self._heard),
            self.session.declare_queryable(ask_key(self.site, self.camera), self._asked),
        ):
            self._work(end)

    def _work(self, end: threading.Event) -> None:
        now = time.monotonic()
        next_health = next_image = now
        while not end.is_set():
            now = time.monotonic()
            if now >= next_health:
                self._put(health_key(self.site, self.camera), encode(self._health()))
                next_health = now + HEALTH_PERIOD
            if self.rate and not self._ended and now >= next_image:
                self._shoot()
                next_image = max(next_image + 1.0 / self.rate, now)
            self._wait(min(next_health, next_image if self.rate and not self._ended else next_health))

    def _wait(self, until: float) -> None:
        """Serve stops until a time."""
        try:
            stop = self._stops.get(timeout=max(0.0, min(until - time.monotonic(), HEALTH_PERIOD)))
        except queue.Empty:
            return
        self._here = stop if stop.standing else None
        for _ in range(stop.burst if stop.standing else 0):
            self._shoot()

    def _shoot(self) -> None:
        captured = time.time()
        image = self.source.take()
        if image is None:
            if not self._ended:
                self._warn(f"{self.source.name}: no image any more")
            self._ended = True
            return
        panels, rejected = self.detect(image)
        self._size = (image.shape[1], image.shape[0])
        self._keep(image)
        self._publish(captured, panels, rejected)

    def _publish(self, captured: float, panels: tuple[Corners, ...], rejected: int) -> None:
        message = Detections(
            sender=self.camera,
            boot=self.boot,
            sequence=self._sequence,
            frame=self._frames,
            survey=self._here.boot if self._here else None,
            stop=self._here.stop if self._here else 0,
            captured=captured,
            clock_sigma=CLOCK_SIGMA,
            width=self._size[0],
            height=self._size[1],
            panels=panels,
            rejected=rejected,
        )
        self._frames += 1
        try:
            data = self.journal.append(message)
        except OSError as error:
            self._warn(f"the journal takes nothing more ({error.strerror}): make room; images are not sent")
            return
        self._sequence += 1
        self._put(data_key(self.site, self.camera), data)

    def _keep(self, image: Grey) -> None:
        self._images[self._frames] = image
        while len(self._images) > IMAGES_KEPT:
            self._images.popitem(last=False)

    def _health(self) -> Health:
        return Health(
            sender=self.camera,
            boot=self.boot,
            counts=self.journal.counts,
            source=self.source.name,
            width=self._size[0],
            height=self._size[1],
            frames=self._frames,
            failures=self.source.failures,
            trouble=self._trouble,
        )

    def _heard(self, sample: zenoh.Sample) -> None:
        try:
            message = decode(sample.payload.to_bytes(), str(sample.key_expr))
        except UserError as error:
            self._warn(str(error))
            return
        if isinstance(message, Stop) and (message.boot, message.sequence) > self._last_stop:
            self._last_stop = (message.boot, message.sequence)
            self._stops.put(message)

    def _asked(self, query: zenoh.Query) -> None:
        where = str(query.key_expr)
        try:
            request = decode(query.payload.to_bytes() if query.payload else b"", where)
            query.reply(where, self._answer(request, where))
        except UserError as error:
            query.reply_err(str(error).encode())

    def _answer(self, request: object, where: str) -> bytes:
        if isinstance(request, Again):
            return b"\n".join(self.journal.read(request.boot, request.first, request.last))
        if not isinstance(request, Picture):
            raise UserError(f"{where}: this is not a request")
        image = self._images.get(request.frame) if request.boot == self.boot else None
        if image is None:
            raise UserError(f"{where}: image {request.frame} is not kept any more")
        return _png(image)

    def _put(self, key: str, data: bytes) -> None:
        self.session.put(key, data)

    def _warn(self, line: str) -> None:
        if line != self._trouble:
            self.report(f"{self.camera}: {line}")
        self._trouble = line


def _png(image: Grey) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()

"""Which messages have arrived, which are missing, whom to ask: no network in it, and no clock.

Senders number their messages 0, 1, ... within a boot. A number may arrive late, twice, or not at all; a sender may end
and start anew. For each boot the collector keeps the numbers it has and the count that the sender has told (by the
highest number seen, or by its health). What lies between is missing and is requested; the answer passes through the
same door, so that an answer may be late or lost as well.

A node that has run for long, or kept the messages of earlier boots, need not send its past: of the boot that runs
when the sender is first heard of, the last `RECALL` messages count, of earlier boots none. Later boots count from 0.

What it does not do: tell that a message was changed on its way; the transport has checksums.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from groma.io.camera_protocol import Again, Numbered

REQUEST_MAX = 200
"""Messages requested at once."""
RECALL = 100
"""Messages from before the first contact that are wanted."""


@dataclass(slots=True)
class _Boot:
    first_open: int
    """All numbers below are there, or not wanted."""
    count: int = 0
    """Numbers that the sender has given, as far as known."""
    ahead: set[int] = field(default_factory=set)
    """Numbers above it that are there."""

    def take(self, sequence: int) -> bool:
        self.count = max(self.count, sequence + 1)
        if sequence < self.first_open or sequence in self.ahead:
            return False
        self.ahead.add(sequence)
        while self.first_open in self.ahead:
            self.ahead.remove(self.first_open)
            self.first_open += 1
        return True

    def gaps(self) -> Iterator[tuple[int, int]]:
        """Yield first and last number of each run that is missing."""
        first = self.first_open
        for sequence in sorted(self.ahead):
            if first < sequence:
                yield first, sequence - 1
            first = sequence + 1
        if first < self.count:
            yield first, self.count - 1


@dataclass(slots=True)
class Tally:
    """What became of the messages of one sender."""

    taken: int = 0
    repeated: int = 0
    missing: int = 0


class Collector:
    """Tell new messages from repeated ones, and what is missing.

    Examples
    --------
    >>> from groma.link.collector import Collector
    >>> from groma.io.camera_protocol import Stop
    >>> stops = [Stop(sender="robot", boot="b", sequence=i, stop=i, stamp=0.0, standing=True) for i in range(4)]
    >>> collector = Collector()
    >>> [collector.take(stops[i]) for i in (0, 3, 3)]
    [True, True, False]
    >>> [(again.first, again.last) for _, again in collector.requests()]
    [(1, 2)]
    """

    def __init__(self) -> None:
        self._boots: dict[tuple[str, str], _Boot] = {}
        self._tallies: dict[str, Tally] = {}
        self._met: set[str] = set()

    def take(self, message: Numbered) -> bool:
        """Return whether a message is new."""
        self._meet(message.sender, {message.boot: message.sequence + 1}, message.boot)
        new = self._boot(message.sender, message.boot).take(message.sequence)
        tally = self._tallies.setdefault(message.sender, Tally())
        tally.taken += new
        tally.repeated += not new
        return new

    def announce(self, sender: str, counts: Mapping[str, int], boot: str) -> None:
        """Learn how many messages a sender has numbered in each boot, and which boot runs."""
        self._meet(sender, counts, boot)
        for name, count in counts.items():
            known = self._boot(sender, name)
            known.count = max(known.count, count)

    def requests(self) -> Iterator[tuple[str, Again]]:
        """Yield what to ask of whom."""
        for (sender, boot), known in sorted(self._boots.items()):
            for first, last in known.gaps():
                for start in range(first, last + 1, REQUEST_MAX):
                    yield sender, Again(boot=boot, first=start, last=min(last, start + REQUEST_MAX - 1))

    def tallies(self) -> dict[str, Tally]:
        """Return the counts by sender."""
        found = {sender: Tally(t.taken, t.repeated) for sender, t in sorted(self._tallies.items())}
        for (sender, _), known in self._boots.items():
            found.setdefault(sender, Tally()).missing += sum(last - first + 1 for first, last in known.gaps())
        return found

    def _meet(self, sender: str, counts: Mapping[str, int], current: str) -> None:
        """At the first contact, say from which numbers on messages are wanted."""
        if sender in self._met:
            return
        self._met.add(sender)
        for boot, count in counts.items():
            self._boots[sender, boot] = _Boot(max(0, count - RECALL) if boot == current else count)

    def _boot(self, sender: str, boot: str) -> _Boot:
        return self._boots.setdefault((sender, boot), _Boot(0))

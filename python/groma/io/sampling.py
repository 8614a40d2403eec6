"""Records spread evenly over a recording of unknown length, in bounded memory.

When the sample is full every second record is dropped and from then on only every second of those offered before is
taken, so what is kept is always every ``stride``-th record.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Generic, TypeVar

T = TypeVar("T")

SAMPLE = 256
"""Records kept at most."""


@dataclass(slots=True)
class Sample(Generic[T]):
    """An even sample."""

    kept: list[T] = field(default_factory=list)
    seen: int = 0
    stride: int = 1

    def offer(self, record: T) -> None:
        """Take the record if it is its turn."""
        if self.seen % self.stride == 0:
            self.kept.append(record)
            if len(self.kept) > SAMPLE:
                del self.kept[1::2]
                self.stride *= 2
        self.seen += 1

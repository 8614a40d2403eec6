"""Put slightly disordered messages into the order of their stamps, in bounded memory.

A message waits until one that is ``LATENESS`` seconds younger has come, so lateness up to that is sorted out. What
cannot be sorted is dropped and counted by reason, never silently:

- late: older than what was already passed on (a log that jumps back and goes on from there loses what it repeats);
- a stamp far ahead (``LEAP``) is believed only when a later message is later still; when the next one is back where
  it was, the leaper is dropped. A real pause in a recording passes, a single wrong stamp does not.

At most ``MOST`` messages wait; beyond that the oldest goes first.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator
from typing import Generic, TypeVar

T = TypeVar("T")

LATENESS = 2.0
LEAP = 30.0
MOST = 4096
MOST_LEAPERS = 16


class Sorter(Generic[T]):
    """Messages in, sorted messages out."""

    def __init__(self, skipped: Counter[str]) -> None:
        self._skipped = skipped
        self._heap: list[tuple[float, int, int, T]] = []
        self._leapers: list[tuple[float, int, T, str]] = []
        self._newest = -float("inf")
        self._arrivals = 0

    def push(self, key: float, rank: int, item: T, kind: str) -> Iterator[T]:
        """Take one message and yield those whose turn has come.

        Parameters
        ----------
        key
            The time that decides the order [s].
        rank
            Of equal times the lower rank goes first.
        item
            The message.
        kind
            What to call it when it is dropped.
        """
        if self._set_aside(key, rank, item, kind):
            return
        if key < self._newest - LATENESS:
            self._skipped[f"{kind} more than {LATENESS:g} s late"] += 1
            return
        self._add(key, rank, item)
        while self._heap and (self._heap[0][0] <= self._newest - LATENESS or len(self._heap) > MOST):
            yield heapq.heappop(self._heap)[3]

    def drain(self) -> Iterator[T]:
        """Yield what still waits."""
        self._believe()
        while self._heap:
            yield heapq.heappop(self._heap)[3]

    def _set_aside(self, key: float, rank: int, item: T, kind: str) -> bool:
        """Keep a leaper apart; each message decides about the leapers that already wait."""
        if self._leapers:
            first = self._leapers[0][0]
            if key > first or len(self._leapers) >= MOST_LEAPERS:
                self._believe()
            elif key < first - LATENESS:
                self._disbelieve()
        if not self._arrivals or key <= self._newest + LEAP:
            return False
        self._leapers.append((key, rank, item, kind))
        return True

    def _believe(self) -> None:
        for key, rank, item, _ in self._leapers:
            self._add(key, rank, item)
        self._leapers.clear()

    def _disbelieve(self) -> None:
        for _, _, _, kind in self._leapers:
            self._skipped[f"{kind} with a stamp more than {LEAP:g} s ahead of its neighbours"] += 1
        self._leapers.clear()

    def _add(self, key: float, rank: int, item: T) -> None:
        self._arrivals += 1
        self._newest = max(self._newest, key)
        heapq.heappush(self._heap, (key, rank, self._arrivals, item))

"""Counters that overflow, made into sums that do not: what encoders of wheels and steering report.

A counter of ``modulus`` values (2^32 for an unsigned 32-bit one, the counts of a turn for an absolute encoder) has gone
the shorter way between two readings; so it must be read at least twice per half modulus. A missing reading (NaN)
changes nothing and is NaN.
"""

from __future__ import annotations

import math

from groma.nouns.bounds import require


class Counter:
    """One counter, read in order of time."""

    def __init__(self, modulus: float = math.inf) -> None:
        self._modulus = modulus
        self._last = math.nan
        self._sum = 0.0

    def read(self, value: float) -> float:
        """Return the count since the counter was at 0 for the first time, without overflows.

        Raises
        ------
        OutOfRangeError
            For a reading that no counter shows; the sum stands as it was.
        """
        if math.isnan(value):
            return math.nan
        require("joint", "count", value)
        if math.isnan(self._last):
            self._sum = value
        else:
            self._sum += shorter_way(value - self._last, self._modulus)
        self._last = value
        return self._sum


def shorter_way(difference: float, modulus: float) -> float:
    """Return a difference of readings, -modulus/2 .. modulus/2."""
    return math.remainder(difference, modulus) if math.isfinite(modulus) else difference

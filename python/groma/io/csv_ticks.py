"""Counts of encoders in groma's CSV, made into joint angles: the lines ENCODER and TICKS (docs/reference/csv.md).

    ENCODER,stream,name,counts_per_turn,modulus
    TICKS,stamp,stream,k,name1,count1,..

ENCODER holds for the TICKS of its stream until the next one of that name. ``counts_per_turn`` nan: unknown, the joint
is reported in ticks. ``modulus`` is the number of values before a counter starts anew (2^32, or the counts of a turn
of an absolute encoder), inf where it never does. A joint without ENCODER is unknown and never overflows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from groma.io.carmen_lines import LineError, Tokens, number
from groma.io.counters import Counter
from groma.nouns.bounds import require
from groma.nouns.messages import JointState


@dataclass(slots=True)
class Encoders:
    """The encoders met so far, and where their counters stand."""

    _scales: dict[tuple[str, str], float] = field(default_factory=dict)
    _counters: dict[tuple[str, str], Counter] = field(default_factory=dict)

    def announce(self, fields: Tokens) -> None:
        """Take an ENCODER line."""
        if len(fields) != 5:
            raise LineError(f"{len(fields)} fields, expected 5")
        key = (_text(fields[1]), _text(fields[2]))
        counts, modulus = number(fields[3], "counts_per_turn"), number(fields[4], "modulus")
        if not math.isnan(counts):
            require("per_turn", "counts_per_turn", counts)
        if modulus != math.inf:
            require("per_turn", "modulus", modulus)
        self._scales[key] = 2 * math.pi / counts
        self._counters[key] = Counter(modulus)

    def joints(self, fields: Tokens) -> JointState:
        """Return a TICKS line as joint angles."""
        if len(fields) < 4:
            raise LineError("fields are missing")
        stamp, stream, count = number(fields[1], "stamp"), _text(fields[2]), number(fields[3], "the number of joints")
        if count != (len(fields) - 4) / 2:
            raise LineError(f"announces {count:g} joints and has {len(fields) - 4} fields for them")
        names = tuple(_text(name) for name in fields[4::2])
        counts = [number(value, "count") for value in fields[5::2]]
        scales = [self._scales.get((stream, name), math.nan) for name in names]
        known = [scale if math.isfinite(scale) else 1.0 for scale in scales]
        sums = [self._counter(stream, name).read(value) for name, value in zip(names, counts, strict=True)]
        unit: Literal["rad", "tick"] = "rad" if all(map(math.isfinite, scales)) else "tick"
        velocities = np.full(len(names), np.nan)
        return JointState(stamp, stream, names, np.array(sums) * np.array(known), velocities, unit)

    def _counter(self, stream: str, name: str) -> Counter:
        return self._counters.setdefault((stream, name), Counter())


def _text(token: bytes) -> str:
    return token.decode(errors="replace").strip()

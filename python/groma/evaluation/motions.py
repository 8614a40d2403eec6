"""Drives before a camera and ways to hold a panel, tried out: what calibrations scatter, held to what was promised.

Of `n` calibrations a root mean square `s` tells the true one to between `s sqrt(n / chi2(1 - p))` and
`s sqrt(n / chi2(p))`, with the quantiles of chi-square for n and `p = 2.5 %` by Wilson and Hilferty, right to 2 % of
the band from n = 5 on.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from msgspec.structs import replace

from groma._core import Token
from groma.planning.camera import DEFAULTS, MOTIONS, Sitting, Stage, Studied, Tried, Tries, study_sitting, try_motion

A = TypeVar("A")
B = TypeVar("B")
Progress = Callable[[int, int], None]
"""Called with the number of parts done and their total."""

STUDY: dict[str, tuple[float, ...]] = {
    "views": (3, 5, 10, 20, 40),
    "tilt": tuple(math.radians(angle) for angle in (5, 10, 20, 30, 45, 60)),
    "distance": (0.7, 1.2, 2.0, 3.0, 4.0),
    "grid": (2, 3, 4, 6, 8),
    "coverage": (0.1, 0.25, 0.5, 0.75, 1.0),
}
"""What is varied in the error study, all else at the defaults."""
_Z = 1.959964


@dataclass(frozen=True, slots=True)
class Varied:
    """One point of the error study."""

    what: str
    """A key of :data:`STUDY`."""
    value: float
    found: Studied


def try_motions(
    stage: Stage,
    distance: float,
    tries: Tries = DEFAULTS.tries,
    progress: Progress | None = None,
    token: Token | None = None,
) -> dict[str, Tried]:
    """Try out all common trajectories, their middle at a distance before the camera [m]."""
    found = _each(MOTIONS, lambda motion: try_motion(stage, motion, distance, tries, token), progress)
    return dict(zip(MOTIONS, found, strict=True))


def study(tries: Tries = DEFAULTS.tries, progress: Progress | None = None, token: Token | None = None) -> list[Varied]:
    """Vary one thing after the other."""
    points = [(what, value, _sitting(what, value)) for what, values in STUDY.items() for value in values]
    sittings = list(dict.fromkeys(sitting for _, _, sitting in points))
    found = dict(zip(sittings, _each(sittings, lambda s: study_sitting(s, tries, token), progress), strict=True))
    return [Varied(what, value, found[sitting]) for what, value, sitting in points]


def rms_band(count: int) -> tuple[float, float]:
    """Return by which factors a true deviation may lie below and above a root mean square of so many values, 95 %.

    Examples
    --------
    >>> [round(factor, 2) for factor in rms_band(20)]
    [0.77, 1.45]
    """
    spread = 2 / (9 * count)
    high, low = ((1 - spread + z * math.sqrt(spread)) ** 3 for z in (_Z, -_Z))
    return 1 / math.sqrt(high), 1 / math.sqrt(low) if low > 0 else math.inf


def _sitting(what: str, value: float) -> Sitting:
    kept = int(value) if what in ("views", "grid") else value
    return replace(DEFAULTS.sitting, **{what: kept})


def _each(values: Sequence[A], work: Callable[[A], B], progress: Progress | None) -> list[B]:
    """Work on all values side by side; results in their order."""
    found: list[B] = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for result in pool.map(work, values):
            found.append(result)
            if progress:
                progress(len(found), len(values))
    return found

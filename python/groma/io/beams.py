"""Ranges as they are logged, made into ours; and the beam geometry that some text logs leave out.

Rule for a log that gives only the number of beams n (CARMEN's own table, with the scanners of other counts that are
in public logs): the fan is centred on straight ahead, and when n is even its last beam is missing, as SICK scanners
count: first beam ``-n/2 * step`` (n even), ``-(n - 1)/2 * step`` (n odd).

    180, 181 -> 1 deg      360, 361 -> 0.5 deg    400, 401 -> 0.25 deg (SICK LMS 2xx)
    541 -> 0.5 deg (SICK LMS 1xx, 5xx)            1081 -> 0.25 deg (Hokuyo UTM-30LX)
    683, 769 -> 360/1024 deg (Hokuyo URG-04LX)
    else 180 deg / (n - 1)

A range that means "no return" is a large number in these logs, and which one is not said. It is inferred from a sample
of scans, see :func:`infer_no_return`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from groma.io.notes import Notes
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry

RANGE_MIN = 0.01
"""Readings below are no surface: scanners report 0 for a failed beam [m]."""
LONGEST_KNOWN = 81.7
"""No scanner of these logs measures farther; taken when nothing else tells [m]."""
SHORTEST_KNOWN = 3.5
"""Every scanner sees farther; a log whose longest reading is shorter was taken in a narrow place [m]."""

_STEPS_DEG = {
    **dict.fromkeys((180, 181), 1.0),
    **dict.fromkeys((360, 361, 541), 0.5),
    **dict.fromkeys((400, 401, 1081), 0.25),
    **dict.fromkeys((683, 769), 360.0 / 1024.0),
}
_SICK_FLAGS = ((8.183, 8.1911), (16.375, 16.3831), (32.759, 32.7671), (81.83, 81.911))
"""SICK LMS 2xx telegrams use the nine largest codes of 13, 14 and 15 bits as flags, in mm or cm."""


def fan(count: int, step: float | None = None) -> tuple[float, float]:
    """Return bearing of the first beam and step [rad] for a number of beams; a given step [rad] wins over the table."""
    if step is None:
        step = math.radians(_STEPS_DEG[count]) if count in _STEPS_DEG else math.pi / max(count - 1, 1)
    half = count / 2 if count % 2 == 0 and (count in _STEPS_DEG) else (count - 1) / 2
    return -half * step, step


def geometry(count: int, range_max: float, step: float | None = None) -> BeamGeometry:
    """Return the assumed geometry of a log that has only a number of beams."""
    angle_min, angle_increment = fan(count, step)
    return BeamGeometry(angle_min, angle_increment, 0.0, RANGE_MIN, range_max)


def normalise(ranges: Array, range_min: float, range_max: float, notes: Notes) -> Array:
    """Return ranges with ``+inf`` for no return and NaN for what is no range; bad readings are counted.

    Parameters
    ----------
    ranges
        (N,) as logged [m]; changed in place.
    range_min
        Shorter readings, zero and negative ones (``-inf``: too close) become NaN.
    range_max
        Readings that reach it become ``+inf``: a scanner that sees nothing reports its limit.
    """
    if not (len(ranges) and ranges.min() >= range_min):
        _drop_invalid(ranges, range_min, notes)
    ranges[ranges >= range_max] = np.inf
    return ranges


def _drop_invalid(ranges: Array, range_min: float, notes: Notes) -> None:
    kinds = {
        "NaN": np.isnan(ranges),
        "negative": ranges < 0,
        "zero": ranges == 0,
        f"below {range_min:g} m": (ranges > 0) & (ranges < range_min),
    }
    for why, which in kinds.items():
        if count := int(np.count_nonzero(which)):
            notes.beams[why] += count
            ranges[which] = np.nan


def infer_no_return(scans: Sequence[Array], positions: Sequence[tuple[float, float]]) -> float | None:
    """Return the range from which on a reading means "no return", or None when nothing stands out.

    Let M be the longest finite reading. Readings are a code, not a surface, when either M is one of SICK's flag
    values, or M is at least ``SHORTEST_KNOWN``, the band ``0.99 M .. M`` holds at least ten readings, more than five
    times as many as any of the nine bands of 1 % below it, and they were seen from places more than ``0.05 M`` apart:
    a far wall would have changed its distance. The code is a cluster (51.10, 51.15, 51.16 in one file), so its lower
    end is returned: the smallest value of the band that occurs at least 3 times and makes up at least 0.1 % of it.

    Parameters
    ----------
    scans
        Ranges of scans spread over the recording [m], as logged.
    positions
        Where each was taken [m]; equal places when unknown, which leaves only the flag values.
    """
    finite = [scan[np.isfinite(scan)] for scan in scans]
    readings = np.concatenate(finite) if finite else np.empty(0)
    if not len(readings):
        return None
    top = float(readings.max())
    for low, high in _SICK_FLAGS:
        if low <= top <= high:
            return low
    if top < SHORTEST_KNOWN or not _stands_out(readings, top) or not _seen_apart(finite, positions, top):
        return None
    return _lower_end(readings[readings >= 0.99 * top])


def _stands_out(readings: Array, top: float) -> bool:
    counts = np.histogram(readings, bins=np.linspace(0.90, 1.0, 11) * top)[0]
    return bool(counts[-1] >= 10 and counts[-1] > 5 * counts[:-1].max())


def _seen_apart(scans: Sequence[Array], positions: Sequence[tuple[float, float]], top: float) -> bool:
    places = np.array([p for scan, p in zip(scans, positions, strict=True) if len(scan) and scan.max() >= 0.99 * top])
    return bool(np.hypot(*np.ptp(places, axis=0)) > 0.05 * top)


def _lower_end(band: Array) -> float:
    values, counts = np.unique(band, return_counts=True)
    return float(values[counts >= max(3, 1e-3 * len(band))].min(initial=values[-1]))

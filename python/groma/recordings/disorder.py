"""How late the messages of a drive come, by a look at its beginning: what a recording asks to wait for.

A message is complete at its stamp, a scan at its last beam. A step back within a stream would lose a message (joints in
messages of their own are streams of their own); odometry or wheels that come after the scan they belong to are
extrapolated, which is as good for a short while (``SLACK``). So a recording asks for as much lateness as its latest
message needs when a stream of it steps back, or when odometry or wheels lag behind the scans by more than ``SLACK``;
else for none.

Not looked at: what lies beyond the first ``LOOK`` messages. A stamp far ahead of all before (``LEAP``) is no measure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import islice

from groma.nouns.messages import JointState, LaserScan, Odometry

LOOK = 600
LEAP = 30.0
"""A stamp this far ahead of all before is a wrong one [s]."""
LONGEST = 2.0
"""No recording asks for more [s]."""
SLACK = 0.1
"""Odometry up to this late is extrapolated rather than waited for [s]."""
_DIGITS = 3


def needed_lateness(events: Iterable[Odometry | JointState | LaserScan], delay: float = 0.0) -> float:
    """Return how long messages should wait to be put into order [s]; 0 for none. Wheels stamp ``delay`` late.

    >>> needed_lateness([Odometry(t, "odom", 0, 0, 0) for t in (0.0, 0.1, 0.3, 0.2, 0.4)])
    0.101
    >>> needed_lateness([Odometry(t, "odom", 0, 0, 0) for t in (0.0, 0.1, 0.2)])
    0.0
    """
    newest = -math.inf
    of_stream: dict[object, float] = {}
    latest = lag = 0.0
    disordered = False
    for event in islice(events, LOOK):
        key = event.end if isinstance(event, LaserScan) else event.stamp
        key -= delay if isinstance(event, JointState) else 0.0
        if not math.isfinite(key) or (math.isfinite(newest) and key > newest + LEAP):
            continue
        if math.isfinite(newest):
            latest = max(latest, newest - key)
            lag = max(lag, 0.0 if isinstance(event, LaserScan) else newest - key)
        stream = event.names if isinstance(event, JointState) else type(event)
        last = of_stream.get(stream, -math.inf)
        disordered |= event.stamp < last
        of_stream[stream] = max(last, event.stamp)
        newest = max(newest, key)
    if not disordered and lag <= SLACK:
        return 0.0
    step: float = 10.0**-_DIGITS
    return min(LONGEST, round(latest + step, _DIGITS))

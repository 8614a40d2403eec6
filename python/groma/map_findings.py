"""What a map says of itself, as findings: torn, strained, without a loop, weakly held, contradicted by its odometry."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from groma.findings import Finding
from groma.io.left_out import left_out
from groma.mapping import Closure, MapResult, WeakSpot
from groma.report.figures import accepted
from groma.report.words import angle, count, length, place, strain

MOST_WEAK = 10
"""Weak stretches that are told one by one, the worst; the others are counted."""
OFFSET_M, OFFSET_SIGMAS = 0.05, 3.0
"""An offset of the scanner is told beyond both."""


def map_findings(result: MapResult) -> list[Finding]:
    """Return the findings on a map, in the order of their weight."""
    return [
        *_torn(result),
        *_violated(result),
        *_weak(result),
        *_overruled(result.counts),
        *_offset(result.counts),
        *left_out({key: value for key, value in result.counts.items() if key.startswith("scans with ")}),
    ]


def _torn(result: MapResult) -> Iterator[Finding]:
    if torn := int(result.counts.get("torn_stretches", 0)):
        text = f"{count(torn, 'time')} a scan was not found on the map and there was no odometry to bridge the gap"
        yield Finding("map-torn", text, values={"stretches": (torn, "1")})


def _violated(result: MapResult) -> Iterator[Finding]:
    good = accepted(result)
    if not good:
        yield Finding("loop-none", "no loop was closed")
    violated = [closure for closure in good if strain(closure) > 1]
    if violated:
        yield _strained(max(violated, key=strain), len(violated), len(good))


def _strained(worst: Closure, violated: int, closures: int) -> Finding:
    text = (
        f"{violated} of {count(closures, 'loop closure')} cannot be met, the worst by {length(worst.residual_m)} and "
        f"{angle(abs(worst.residual_rad))} near {place(worst.to_xy)}"
    )
    values = {
        "violated": (violated, "1"),
        "residual": (worst.residual_m, "m"),
        "residual_angle": (worst.residual_rad, "rad"),
    }
    return Finding("closure-violated", text, (worst.from_stamp, worst.to_stamp), worst.to_xy, values)


def _weak(result: MapResult) -> Iterator[Finding]:
    worst_first = sorted(result.weak, key=lambda spot: -spot.sigma_m)
    yield from map(_stretch, worst_first[:MOST_WEAK])
    if others := worst_first[MOST_WEAK:]:
        text = f"{len(others)} more are weakly held, none worse than {length(others[0].sigma_m)}"
        yield Finding("weak-stretch", text, values={"stretches": (len(others), "1")})


def _stretch(spot: WeakSpot) -> Finding:
    text = f"near {place(spot.xy)} a scan holds the position to {length(spot.sigma_m)} only: {spot.why}"
    values = {"sigma": (spot.sigma_m, "m"), "direction": (spot.direction, "rad")}
    return Finding("weak-stretch", text, (spot.from_stamp, spot.to_stamp), spot.xy, values)


def _overruled(counts: Mapping[str, float]) -> Iterator[Finding]:
    if failed := int(counts.get("scans_whose_odometry_failed", 0)):
        text = f"odometry predicted {count(failed, 'scan')} so badly that it was left out there"
        yield Finding("odometry-overruled", text, values={"scans": (failed, "1")})


def _offset(counts: Mapping[str, float]) -> Iterator[Finding]:
    x, y = (counts.get(f"laser_offset_{axis}_m", 0.0) for axis in "xy")
    sigma = max(counts.get(f"laser_offset_{axis}_sigma_m", math.inf) for axis in "xy")
    if math.hypot(x, y) > max(OFFSET_M, OFFSET_SIGMAS * sigma):
        text = (
            f"odometry and scans agree best with the laser {x:.2f} m ahead and {y:.2f} m to the left of where the "
            "recording puts it; the poses written are those of the frame that the recording gives"
        )
        yield Finding("scanner-offset", text, values={"x": (x, "m"), "y": (y, "m"), "sigma": (sigma, "m")})

"""A map in words: whether it is consistent, on how many loops it rests, where it is weak."""

from __future__ import annotations

import math

from groma.mapping.result import Closure, MapResult, WeakSpot
from groma.nouns.findings import Finding
from groma.report.map.figures import accepted
from groma.report.words import angle, count, length, place

STRAINED_M = 0.2
STRAINED_RAD = math.radians(1)
"""A closure is violated if its residual after optimisation exceeds this (Hess et al., ICRA 2016, table IV)."""


def verdict(result: MapResult) -> str:
    """Return one sentence: whether the map is consistent, by how many loop closures, and where it is weak."""
    return f"{_consistency(result)}{_weakness(result.weak)}."


def strain(closure: Closure) -> float:
    """Return the residual of a closure as a fraction of the limit; above 1 it is violated."""
    return max(closure.residual_m / STRAINED_M, abs(closure.residual_rad) / STRAINED_RAD)


def _consistency(result: MapResult) -> str:
    good = accepted(result)
    found = {finding.code: finding for finding in result.findings}
    if torn := sum(finding.code == "map-torn" for finding in result.findings):
        return (
            f"The map may be torn: {count(torn, 'time')} tracking was lost and there was no odometry to bridge the "
            "gap, so that what follows may be misplaced"
        )
    if strained := found.get("closure-violated"):
        return f"The map is strained: {_strain_words(strained)}, where walls may be doubled"
    if not good:
        return "No loop was closed: the map depends on scan-to-scan registration alone"
    agree = "agrees" if len(good) == 1 else "agree"
    largest = max(closure.residual_m for closure in good)
    return f"The map is consistent: {count(len(good), 'loop closure')} {agree} with it to {length(largest)}"


def _strain_words(strained: Finding) -> str:
    worst, turn = strained.values["worst"][0], strained.values["worst_turn"][0]
    near = f" near {place(strained.place)}" if strained.place else ""
    return f"{strained.text}, the worst by {length(worst)} and {angle(abs(turn))}{near}"


def _weakness(weak: tuple[WeakSpot, ...]) -> str:
    if not weak:
        return ", and no stretch of the drive is weakly constrained"
    worst = max(weak, key=lambda spot: spot.sigma_m)
    return (
        f"; it is weakest near {place(worst.xy)}, where the standard deviation of the position from scans alone is "
        f"{length(worst.sigma_m)} ({worst.why})"
    )

"""Print what the next best drive takes against common trajectories, before cameras in many places.

.venv/bin/python benches/planning_camera.py [PLACES]

Cameras are about 2 m up, the middle of the drives 2 to 3.5 m before them. Either robot has the same three panels, 45
degrees apart; the drive across the view has them on its side. The best common trajectory is the one with the lowest
worst pixel, which then is the target of the next best one. Told are distance, effort at the wheels with turns [m],
looks, and what odometry adds to the place of the camera [mm]; of the next best one also its share of either.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from msgspec.structs import replace

from groma.planning.camera import DEFAULTS, CameraPlan, Judged, Stage, middle_height, mount, plan_camera, ranked


def compared(height: float, distance: float) -> tuple[Judged, CameraPlan]:
    """Return the best common trajectory, and the next best one to the same worst pixel."""
    stage = Stage(mount(height, math.atan2(height - middle_height(DEFAULTS.target), distance)))
    best = next(judged for judged in ranked(stage, distance) if not judged.degenerate)
    return best, plan_camera(stage, (distance, 0.0, math.pi), replace(DEFAULTS.search, target=best.worst))


def lattice(count: int) -> list[tuple[float, float]]:
    """Return heights and distances [m]: the places on which the lattice of candidate drives was chosen."""
    return [(1.6 + 0.25 * (k % 5), 2.0 + 0.5 * (k // 5 % 4)) for k in range(count)]


def drawn(count: int) -> list[tuple[float, float]]:
    """Return heights and distances [m] drawn anew, on which nothing was chosen."""
    return [(float(h), float(d)) for h, d in np.random.default_rng(1).uniform([1.5, 2.0], [2.8, 3.5], (count, 2))]


def main() -> None:
    """Print a line a place, and the means, of both kinds of places."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for kind in (lattice, drawn):
        tell(kind.__name__)
        tell(f" up   away best fixed    pixel  distance  effort  looks  odometry  next best{'shares':>26}")
        shares = [shares_at(height, distance) for height, distance in kind(count)]
        for name, row in (("mean", np.mean(shares, axis=0)), ("largest", np.max(shares, axis=0))):
            tell(f"{name:85}  {row[0]:9.2f}  {row[1]:4.2f}")


def shares_at(height: float, distance: float) -> tuple[float, float]:
    """Print the line of a place; return the shares of distance and effort, infinite where the target is not met."""
    best, plan = compared(height, distance)
    end = plan.end
    share = (end.length / best.length, end.effort / best.effort) if plan.met else (math.inf, math.inf)
    tell(
        f"{height:4.2f}  {distance:3.1f} {best.motion:13} {best.worst:5.2f}"
        f"  {best.length:8.1f}  {best.effort:6.1f}  {len(best.stops):5}  {1000 * math.sqrt(best.variance):8.0f}"
        f"  {end.length:4.1f}  {end.effort:4.1f}  {plan.looks:3}  {1000 * math.sqrt(end.variance):4.0f}"
        f"  {share[0]:9.2f}  {share[1]:4.2f}"
    )
    return share


def tell(line: str) -> None:
    """Write a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()

"""The arcs of a plan on their floor, as a picture."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from groma.nouns.arrays import Array
from groma.planning.vehicle import VehiclePlan

POINTS = 60
"""Points of a drawn arc."""


def plan_picture(plan: VehiclePlan, floor: Array | None, path: Path) -> None:
    """Draw the path of the base of every arc, forward and backward apart, and write it as PNG."""
    figure, axes = plt.subplots(figsize=(7.0, 6.0), layout="constrained")
    if floor is not None:
        axes.fill(*floor.T, facecolor="0.95", edgecolor="0.4", label="floor")
    seen: set[bool] = set()
    for k in range(len(plan.path)):
        forward = bool(plan.path[k] > 0)
        line = base_path(plan, k)
        label = None if forward in seen else "forward" if forward else "backward"
        axes.plot(*line.T, color="tab:blue" if forward else "tab:orange", alpha=0.6, label=label)
        axes.plot(*line[0], ".", color="0.2", markersize=4)
        seen.add(forward)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(f"{len(plan.path)} arcs, {plan.time:.0f} s: path of the base, dots where it starts")
    axes.legend(loc="upper right")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def base_path(plan: VehiclePlan, k: int) -> Array:
    """(POINTS, 2) of the base along one arc, from its start."""
    x, y, heading = plan.start[k]
    turn = plan.turn[k] * np.linspace(0.0, 1.0, POINTS)
    length = plan.base[k] * np.linspace(0.0, 1.0, POINTS)
    half = turn / 2.0
    chord = length * np.sinc(half / np.pi)
    return np.column_stack([x + chord * np.cos(heading + half), y + chord * np.sin(heading + half)])

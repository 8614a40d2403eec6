"""The figures of the report on a vehicle, each a function from the result to an SVG element."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from groma.nouns.arrays import Array
from groma.report import drawing
from groma.report.drawing import FINAL, LINE, MUTED, REJECTED, TRACKED, WIDTH, drawn
from groma.report.vehicle.figures import driven
from groma.vehicle.recording import CalibratedVehicle

_LEFT, _RIGHT, _BOTTOM = 0.65, 0.1, 0.45
_DOUBTED = 0.3
"""Weight below which a motion is drawn as an outlier."""
_TALLEST = 0.9
_LABELS = ("ahead [mm]", "left [mm]", "turn [deg]")
_FACTORS = np.array([1e3, 1e3, 180 / np.pi])


@drawn("Residual of every motion, along the drive")
def along_the_drive(result: CalibratedVehicle) -> Figure:
    """Draw the residuals of the motions over time, one panel per component."""
    motions = result.data.motions
    time = (motions.start + motions.end) / 2 - motions.start[0]
    return _panels(result, time, "time [s]")


@drawn("Residual of every motion, by curvature of its path")
def by_turn(result: CalibratedVehicle) -> Figure:
    """Draw the residuals over the curvature of the way."""
    return _panels(result, driven(result).turn, "curvature [rad/m]")


@drawn("Residual of every motion, by speed")
def by_speed(result: CalibratedVehicle) -> Figure:
    """Draw the residuals over the speed."""
    return _panels(result, driven(result).speed, "speed [m/s]")


@drawn("Path of the laser: measured, and by the calibrated wheels")
def paths(result: CalibratedVehicle) -> Figure:
    """Draw the path of the laser as measured and as the wheels tell it."""
    pieces = result.core.laser_paths()
    points = np.vstack([path for piece in pieces for path in piece])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * max(*(high - low), 0.5)
    low, high = low - margin, high + margin
    width = WIDTH - _LEFT - _RIGHT
    scale = min(width / (high[0] - low[0]), WIDTH * _TALLEST / (high[1] - low[1]))
    size = (high - low) * scale
    sheet = drawing.sheet(size[1] + _BOTTOM + 0.1)
    ax = drawing.axes(sheet, _LEFT, _BOTTOM, size[0], size[1])
    for _, path in pieces:
        ax.plot(path[:, 0], path[:, 1], "-", color=FINAL, linewidth=1.2)
    for path, _ in pieces:
        ax.plot(path[:, 0], path[:, 1], "x", color=REJECTED, markersize=4, markeredgewidth=0.9)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
    return sheet


def _panels(result: CalibratedVehicle, x: Array, label: str) -> Figure:
    height, gap = 1.0, 0.3
    sheet = drawing.sheet(_BOTTOM + 3 * (height + gap))
    residuals = result.found.residuals * _FACTORS
    forward = driven(result).path >= 0
    for row, name in enumerate(_LABELS):
        ax = drawing.axes(sheet, _LEFT, _BOTTOM + (2 - row) * (height + gap), WIDTH - _LEFT - _RIGHT, height)
        ax.set_title(name)
        ax.axhline(0, color=LINE, linewidth=0.8, zorder=0)
        _dots(ax, x, residuals[:, row], forward, result.found.weights)
        ax.tick_params(labelbottom=row == 2, labelcolor=MUTED)
        ax.locator_params(axis="y", nbins=4)
    ax.set_xlabel(label)
    return sheet


def _dots(ax: Axes, x: Array, y: Array, forward: NDArray[np.bool_], weights: Array) -> None:
    doubted = ~(weights >= _DOUBTED)
    for mine, colour in ((forward, FINAL), (~forward, TRACKED)):
        ax.plot(x[mine & ~doubted], y[mine & ~doubted], "o", color=colour, markersize=3.5, alpha=0.8)
        ax.plot(x[mine & doubted], y[mine & doubted], "x", color=colour, markersize=4.5, markeredgewidth=1)
    if (~doubted).any():
        reach = 1.6 * float(np.abs(y[~doubted]).max()) + 1e-9
        ax.set_ylim(-reach, reach)

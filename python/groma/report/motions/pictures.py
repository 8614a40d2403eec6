"""Pictures of the error study: curves over number of views, tilt, distance, grid and coverage."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groma.evaluation.motions import Varied, rms_band
from groma.nouns.arrays import Array
from groma.planning.camera import Studied
from groma.report.drawing import FINAL, INK, LINE, WIDTH, axes, drawn, sheet

_Pick = Callable[[Studied], tuple[float | None, float | None]]
"""Takes what was found and what was promised."""

LABELS = {
    "views": ("views", 1.0),
    "tilt": ("tilt [°]", 180 / math.pi),
    "distance": ("distance [m]", 1.0),
    "grid": ("tags in a row", 1.0),
    "coverage": ("share of width and height", 1.0),
}
"""Of each thing varied: the label of its axis, and what its values are multiplied by."""
_LOGARITHMIC = ("views", "tilt", "distance")


@drawn("Error of the focal length against number of views, tilt, distance, grid and coverage")
def the_focal_length(points: Sequence[Varied]) -> Figure:
    """Draw errors of fx in percent, and what was promised."""
    return _curves(points, lambda s: (s.focal, s.focal_promised), 100.0, "σ of fx [%]")


@drawn("Error of the worst pixel against number of views, tilt, distance, grid and coverage")
def the_worst_pixel(points: Sequence[Varied]) -> Figure:
    """Draw errors of the worst pixel, and what was promised."""
    return _curves(points, lambda s: (s.worst, s.worst_promised), 1.0, "worst pixel, σ [px]")


def _curves(points: Sequence[Varied], pick: _Pick, scale: float, label: str) -> Figure:
    kinds = list(dict.fromkeys(point.what for point in points))
    figure = sheet(5.2)
    across, tall = (WIDTH - 3 * 0.62) / 3, 1.85
    for k, what in enumerate(kinds):
        row, column = divmod(k, 3)
        ax = axes(figure, 0.62 + column * (across + 0.55), 3.1 - row * 2.6, across, tall)
        _curve(ax, [point for point in points if point.what == what], pick, scale)
        ax.set(xlabel=LABELS[what][0], ylabel=label if column == 0 else "")
    return figure


def _curve(ax: Axes, points: Sequence[Varied], pick: _Pick, scale: float) -> None:
    factor = LABELS[points[0].what][1]
    kept = [point for point in points if None not in pick(point.found)]
    x = np.array([point.value * factor for point in kept])
    found, promised = scale * np.array([pick(point.found) for point in kept], dtype=np.float64).reshape(-1, 2).T
    bands = np.array([rms_band(point.found.calibrated) for point in kept]).reshape(-1, 2)
    ax.fill_between(x, found * bands[:, 0], found * bands[:, 1], color=FINAL, alpha=0.18, linewidth=0)
    ax.plot(x, found, color=FINAL, marker=".", markersize=5)
    ax.plot(x, promised, color=INK, linewidth=0.9, linestyle=(0, (3, 2)))
    ax.set(yscale="log")
    if points[0].what in _LOGARITHMIC:
        ax.set(xscale="log")
    ax.xaxis.set_ticks(x, [f"{value:.3g}" for value in x])
    ax.xaxis.set_ticks([], minor=True)
    _plain(ax, np.concatenate([found * bands[:, 0], found * bands[:, 1], promised]))


def _plain(ax: Axes, values: Array) -> None:
    """Let the axis across the values have ticks at 1, 2 and 5, written out."""
    if not len(values):
        return
    low, high = 0.9 * values.min(), 1.1 * values.max()
    ticks = [m * 10.0**e for e in range(-4, 5) for m in (1, 2, 5) if low <= m * 10.0**e <= high]
    ax.set_ylim(low, high)
    ax.yaxis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.yaxis.set_ticks([], minor=True)
    ax.grid(axis="y", color=LINE, linewidth=0.4)

"""The figures of the report on a localized drive, each a function from the result to an SVG element."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from groma.localization.result import Localized
from groma.nouns.arrays import Array
from groma.report import drawing
from groma.report.drawing import ACCEPTED, FINAL, LINE, MUTED, REJECTED, TRACKED, WEAK, WIDTH, drawn
from groma.report.localization.figures import chi_square_shares
from groma.report.plan import BOTTOM, LEFT, RIGHT, draw_curve, draw_ends, draw_path, plan, walls

WINDOW = 21
"""Scans over which the squared innovations are averaged."""
NUMBERED = 40
"""Halts that bear a number in the map."""


@drawn("The drive on the map, the landmarks that held it, its halts")
def the_drive(result: Localized) -> Figure:
    """Draw the drive on the map with the landmarks, paired and not, its halts and its weak stretches."""
    sheet, ax, extent = _map(result)
    positions, used = result.chart.landmarks.positions, result.used > 0
    posts = result.chart.landmarks.kinds == "reflector"
    for group, marker, colour, size in (
        (~used, ".", MUTED, 2.2),
        (used & ~posts, ".", ACCEPTED, 4.0),
        (used & posts, "D", TRACKED, 3.2),
    ):
        ax.plot(*positions[group].T, marker, color=colour, markersize=size, markeredgewidth=0, zorder=3)
    known = result.status != "lost"
    draw_path(ax, _gapped(result.poses, known), FINAL, extent, linewidth=1.1, zorder=4)
    for spot in result.weak:
        inside = (result.stamps >= spot.from_stamp) & (result.stamps <= spot.to_stamp) & known
        ax.plot(*result.poses[inside, :2].T, color=WEAK, linewidth=3.0, solid_capstyle="butt", zorder=5)
    _halts(ax, result)
    if known.any():
        draw_ends(ax, result.poses[known])
    ax.set(xlim=extent[:2], ylim=extent[2:])
    return sheet


@drawn("Uncertainty, landmarks and innovations along the drive")
def along_the_drive(result: Localized) -> Figure:
    """Draw the standard deviations, the number of landmarks and the innovations over the length of the way."""
    known = result.status != "lost"
    way = result.way
    panels = [
        ("Standard deviation of the position [mm]", 1000 * result.sigma_position[known], FINAL),
        ("Standard deviation of the heading [degrees]", np.degrees(result.sigma_heading[known]), FINAL),
        ("Landmarks that constrained the pose, a scan", result.matched.astype(np.float64), ACCEPTED),
        (f"Squared innovations per degree of freedom, {WINDOW} scans", consistency(result), TRACKED),
    ]
    height = 1.0
    sheet = drawing.sheet(BOTTOM + len(panels) * (height + 0.32))
    for row, (title, values, colour) in enumerate(reversed(panels)):
        ax = drawing.axes(sheet, LEFT, BOTTOM + row * (height + 0.32), WIDTH - LEFT - RIGHT, height)
        draw_curve(ax, title, way if len(values) == len(way) else way[known], values, colour)
        for spot in result.weak:
            start, end = np.interp([spot.from_stamp, spot.to_stamp], result.stamps, way)
            ax.axvspan(start, end, color=WEAK, alpha=0.16, linewidth=0, zorder=0)
        if row == 0:
            ax.axhline(1.0, color=LINE, linewidth=0.9, linestyle=(0, (4, 3)), zorder=0)
            ax.set_xlabel("way [m]")
        ax.set_xlim(0, max(way.max(initial=0.0), 1.0))
        ax.tick_params(labelbottom=row == 0)
    return sheet


@drawn("How large the innovations are against what they should be")
def innovations(result: Localized) -> Figure:
    """Draw the distribution of the squared innovations, each brought to the share of a chi-square below it."""
    shares = chi_square_shares(result.nis, result.dof)
    sheet = drawing.sheet(1.9)
    ax = drawing.axes(sheet, LEFT, BOTTOM, WIDTH - LEFT - RIGHT, 1.25)
    ax.hist(shares, bins=20, range=(0, 1), color=TRACKED, alpha=0.8, density=True)
    ax.axhline(1.0, color=REJECTED, linewidth=0.9, linestyle=(0, (4, 3)))
    ax.set(xlim=(0, 1), xlabel="share of a chi-square that lies below", ylabel="density")
    return sheet


def consistency(result: Localized) -> Array:
    """Return the squared innovations over their degrees of freedom (K,), summed over a window; NaN without any."""
    kernel = np.ones(min(WINDOW, len(result.nis)))
    innovations, freedom = (np.convolve(v, kernel, mode="same") for v in (result.nis, result.dof.astype(np.float64)))
    ratio: Array = np.divide(innovations, freedom, out=np.full(len(freedom), np.nan), where=freedom > 0)
    return ratio


def _map(result: Localized) -> tuple[Figure, Axes, tuple[float, float, float, float]]:
    if result.chart.grid is not None:
        image, extent = walls(result.chart.grid)
        sheet, ax = plan(extent)
        ax.imshow(image, extent=extent, origin="lower", interpolation="none", zorder=0)
        return sheet, ax, extent
    points = np.vstack([result.poses[:, :2], result.chart.landmarks.positions])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.03 * max(*(high - low), 1.0)
    extent = (float(low[0] - margin), float(high[0] + margin), float(low[1] - margin), float(high[1] + margin))
    return *plan(extent), extent


def _gapped(poses: Array, known: NDArray[np.bool_]) -> Array:
    """Return the poses that are known; the others are left out."""
    return poses[known]


def _halts(ax: Axes, result: Localized) -> None:
    for number, halt in enumerate(result.halts[:NUMBERED], 1):
        ax.plot(*halt.pose[:2], "o", color=REJECTED, markersize=4, markerfacecolor="none", zorder=6)
        ax.annotate(str(number), halt.pose[:2], (4, 4), textcoords="offset points", color=REJECTED, fontsize=8)

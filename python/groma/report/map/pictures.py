"""The figures of the report on a map, each a function from the result to an SVG element.

Axes of maps are in metres, x to the right, y up, at one scale. Paths are thinned to what can be seen.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from groma.mapping.result import Closure, MapResult, WeakSpot
from groma.nouns.arrays import Array
from groma.report import drawing
from groma.report.drawing import ACCEPTED, FINAL, LINE, MUTED, ODOMETRY, REJECTED, TRACKED, WEAK, WIDTH, drawn
from groma.report.map.figures import accepted, drift, node_sigmas, path_length, rejected
from groma.report.plan import BOTTOM, LEFT, RIGHT, draw_curve, draw_ends, draw_path, plan, walls

NUMBERED = 12
"""Weak spots that bear a number in the map."""

_SMALLEST_SHOWN = 1e-3


@drawn("Map with the drive, loop closures and weak spots")
def the_map(result: MapResult) -> Figure:
    """Draw the occupancy map with the final drive, its loop closures and weak spots."""
    image, extent = walls(result.grid)
    sheet, ax = plan(extent)
    ax.imshow(image, extent=extent, origin="lower", interpolation="none", zorder=0)
    _links(ax, accepted(result))
    draw_path(ax, result.trajectory, FINAL, extent, linewidth=0.9, alpha=0.9)
    _weak_spots(ax, result.weak, 0.02 * max(extent[1] - extent[0], extent[3] - extent[2]))
    draw_ends(ax, result.trajectory)
    ax.set(xlim=extent[:2], ylim=extent[2:])
    return sheet


@drawn("The drive by odometry, by registration, and final")
def before_and_after(result: MapResult) -> Figure:
    """Draw the drive by odometry alone, by registration alone, and as it is in the map."""
    paths = [path for path in (result.odometry, result.tracked, result.trajectory) if np.isfinite(path).any()]
    points = np.vstack([path[:, :2] for path in paths]) if paths else np.zeros((1, 2))
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    margin = 0.03 * max(*(high - low), 1.0)
    extent = (low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin)
    sheet, ax = plan(extent)
    draw_path(ax, result.odometry, ODOMETRY, extent, linewidth=0.9, linestyle=(0, (2, 1.5)))
    draw_path(ax, result.tracked, TRACKED, extent, linewidth=1.1)
    draw_path(ax, result.trajectory, FINAL, extent, linewidth=1.1)
    draw_ends(ax, result.trajectory)
    ax.set(xlim=extent[:2], ylim=extent[2:])
    return sheet


@drawn("Drift and uncertainty along the drive")
def along_the_drive(result: MapResult) -> Figure:
    """Draw drift and uncertainty over the length of the path, one panel each."""
    path = path_length(result.trajectory)
    node_path = np.interp(result.graph.stamps, result.trajectory_stamps, path)
    panels = [
        ("Tracked against final [m]", path, drift(result.tracked, result.trajectory), TRACKED),
        ("Standard deviation of the position [m]", node_path, node_sigmas(result.graph)[0], FINAL),
    ]
    if np.isfinite(result.odometry).any():
        panels.insert(0, ("Odometry against final [m]", path, drift(result.odometry, result.trajectory), ODOMETRY))
    height = 1.05
    sheet = drawing.sheet(BOTTOM + len(panels) * (height + 0.32))
    for row, (title, x, y, colour) in enumerate(reversed(panels)):
        ax = drawing.axes(sheet, LEFT, BOTTOM + row * (height + 0.32), WIDTH - LEFT - RIGHT, height)
        draw_curve(ax, title, x, y, colour)
        _stretches(ax, result, path)
        ax.set_xlim(0, max(path.max(initial=0.0), 1.0))
        ax.tick_params(labelbottom=row == 0)
        if row == 0:
            ax.set_xlabel("path [m]")
    return sheet


@drawn("Loop closures: correction and residual")
def closures(result: MapResult) -> Figure:
    """Draw what every closure moved and residual of it."""
    sheet = drawing.sheet(3.1)
    ax = drawing.axes(sheet, LEFT + 0.1, BOTTOM, WIDTH - LEFT - 0.1 - RIGHT, 2.5)
    styles = [(rejected(result), REJECTED, "x"), (accepted(result), ACCEPTED, "o")]
    for group, colour, marker in styles:
        moved = np.array([max(c.correction_m, _SMALLEST_SHOWN) for c in group])
        left = np.array([max(c.residual_m, _SMALLEST_SHOWN) for c in group])
        ax.plot(moved, left, marker, color=colour, markersize=4, alpha=0.75, markeredgewidth=1)
    ax.set(xscale="log", yscale="log", xlabel="moved by [m]", ylabel="left over [m]")
    ends = [*ax.get_xlim(), *ax.get_ylim()]
    ax.axline((1, 1), (10, 10), color=LINE, linewidth=0.8, linestyle=(0, (4, 3)), zorder=0)
    ax.set(xlim=ends[:2], ylim=ends[2:])
    _plain_ticks(ax)
    return sheet


def _links(ax: Axes, group: list[Closure]) -> None:
    """Draw closures as lines; hundreds of them are a web that would hide the walls, so the more the paler."""
    lines = [np.array([c.from_xy, c.to_xy]) for c in group]
    pale = max(0.12, min(0.9, 20 / max(len(group), 1)))
    ax.add_collection(LineCollection(lines, colors=ACCEPTED, linewidths=0.9, alpha=pale), autolim=False)


def _weak_spots(ax: Axes, weak: tuple[WeakSpot, ...], reach: float) -> None:
    """Draw each spot as a bar along its weak direction; the worst bear the numbers of the table."""
    bars = [np.array(spot.xy) + np.outer([-reach, reach], _unit(spot.direction)) for spot in weak]
    ax.add_collection(LineCollection(bars, colors=WEAK, linewidths=2.6, capstyle="butt"), autolim=False)
    for place, spot in enumerate(worst_first(weak)[:NUMBERED], 1):
        ax.annotate(str(place), spot.xy, (5, 5), textcoords="offset points", color=WEAK, fontsize=10, fontweight="bold")


def worst_first(weak: tuple[WeakSpot, ...]) -> list[WeakSpot]:
    """Return the weak spots in the order of the table."""
    return sorted(weak, key=lambda spot: -spot.sigma_m)


def _unit(direction: float) -> Array:
    return np.array([np.cos(direction), np.sin(direction)])


def _stretches(ax: Axes, result: MapResult, path: Array) -> None:
    """Shade the weak stretches and mark where loops were closed."""
    for spot in result.weak:
        start, end = np.interp([spot.from_stamp, spot.to_stamp], result.trajectory_stamps, path)
        ax.axvspan(start, end, color=WEAK, alpha=0.16, linewidth=0, zorder=0)
    at = np.interp([c.to_stamp for c in accepted(result)], result.trajectory_stamps, path)
    top = ax.get_xaxis_transform()
    ax.plot(at, np.full(len(at), 0.96), "|", color=ACCEPTED, markersize=6, markeredgewidth=0.9, transform=top)


def _plain_ticks(ax: Axes) -> None:
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=9))
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_locator(NullLocator())
    ax.grid(color=LINE, linewidth=0.5, alpha=0.6)
    ax.tick_params(labelcolor=MUTED)

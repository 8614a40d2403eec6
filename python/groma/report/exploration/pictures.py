"""Pictures of an exploration: the walk, what is known as it goes on, and the trade-off of strategies."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray
from PIL import Image

from groma.evaluation.exploration import Traded
from groma.nouns.building import Graph
from groma.nouns.maps import OccupancyGrid
from groma.planning.exploration import Run, StrategyName
from groma.planning.waypoints import points
from groma.report.drawing import (
    ACCEPTED,
    FINAL,
    INK,
    LINE,
    MUTED,
    ODOMETRY,
    REJECTED,
    TRACKED,
    WEAK,
    axes,
    drawn,
    sheet,
)
from groma.report.plan import walls
from groma.report.words import count

COLOURS: dict[StrategyName, str] = {
    "depth-first": ODOMETRY,
    "nearest": INK,
    "return-to-origin": REJECTED,
    "return-to-nearest": WEAK,
    "cheap": TRACKED,
    "search": ACCEPTED,
    "survey": FINAL,
}
MARKS = {"depth-first": "s", "nearest": "^", "return-to-origin": "D", "return-to-nearest": "v"}
FRAMES = 80
"""Most frames of an animation; of longer walks, every second stop and so on is shown."""
_ELLIPSE = 2.0
"""Standard deviations that an ellipse shows."""
_TALLEST, _WIDE = 6.5, 6.5


@drawn("The walk through the building, with the uncertainty of the cameras")
def the_walk(graph: Graph, run: Run, grid: OccupancyGrid | None = None) -> Figure:
    """Draw the ways, how often each was driven, and the final uncertainty of every camera, on the map if any."""
    low, high = _extent(graph)
    width, height = high - low
    scale = min(_WIDE / width, _TALLEST / height)
    figure = sheet(height * scale + 0.6)
    ax = axes(figure, 0.55, 0.45, width * scale, height * scale)
    _draw(ax, graph, run, grid, len(run.stops) - 1)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
    return figure


@drawn("Uncertainty of the cameras against the distance driven")
def the_progress(run: Run) -> Figure:
    """Draw the standard deviation of the cameras found so far, and of the robot, against the distance."""
    figure = sheet(2.6)
    ax = axes(figure, 0.6, 0.5, 6.5, 2.0)
    length = [stop.length for stop in run.stops]
    robot = [math.sqrt(max(stop.robot[0] + stop.robot[2], 0.0)) for stop in run.stops]
    ax.plot(length, robot, color=ODOMETRY, linewidth=0.9)
    ax.plot(length, [stop.sigma for stop in run.stops], color=FINAL, linewidth=1.6)
    complete = [stop.length for stop in run.stops if stop.complete]
    if complete:
        ax.axvline(complete[0], color=MUTED, linewidth=0.8, linestyle=(0, (3, 2)))
    ax.set(xlabel="distance [m]", ylabel="σ [m]", xlim=(0, max(length[-1], 1.0)), ylim=(0, None))
    return figure


@drawn("Distance against uncertainty of all strategies")
def the_trade_off(curves: Sequence[Traded]) -> Figure:
    """Draw every strategy: a curve over lambda where it weighs, a point where it does not; bands of 95 %."""
    figure = sheet(4.3)
    ax = axes(figure, 0.6, 0.5, 6.5, 3.7)
    for strategy, colour in COLOURS.items():
        own = [point for point in curves if point.strategy == strategy]
        if own:
            _curve(ax, own, colour)
    ax.set(xscale="log", yscale="log", xlabel="mean distance [m]", ylabel="mean σ of the cameras [m]")
    for axis, low, high in ((ax.xaxis, *ax.get_xlim()), (ax.yaxis, *ax.get_ylim())):
        ticks = [m * 10.0**e for e in range(-3, 6) for m in (1, 1.5, 2, 3, 5, 7) if low <= m * 10.0**e <= high]
        axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_ticks([], minor=True)
    ax.grid(color=LINE, linewidth=0.4)
    return figure


def animation(graph: Graph, run: Run, grid: OccupancyGrid | None = None) -> bytes:
    """Return the walk as an animated GIF, on the map if any: the robot, what it knows, and how well."""
    step = max(1, math.ceil(len(run.stops) / FRAMES))
    shown = [*range(0, len(run.stops) - 1, step), len(run.stops) - 1]
    images = [_frame(graph, run, grid, number) for number in shown]
    file = io.BytesIO()
    times = [250] * (len(images) - 1) + [2500]
    images[0].save(file, format="GIF", save_all=True, append_images=images[1:], duration=times, loop=0)
    return file.getvalue()


def _frame(graph: Graph, run: Run, grid: OccupancyGrid | None, number: int) -> Image.Image:
    low, high = _extent(graph)
    width, height = high - low
    scale = min(6.0 / width, 6.0 / height)
    figure = Figure((width * scale + 0.2, height * scale + 0.5), dpi=80, facecolor="white")
    ax = figure.add_axes((0.02, 0.02, 0.96, 0.96 - 0.35 / figure.get_figheight()))
    _draw(ax, graph, run, grid, number)
    stop = run.stops[number]
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[])
    found = count(len(stop.cameras), "camera")
    ax.set_title(f"{stop.length:.0f} m   σ {stop.sigma:.3f} m   {found}", loc="left", fontsize=10)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=80)
    file.seek(0)
    return Image.open(file).convert("RGB").quantize(32)


def _draw(ax: Axes, graph: Graph, run: Run, grid: OccupancyGrid | None, last: int) -> None:
    ax.set_aspect("equal")
    if grid is not None:
        image, extent = walls(grid)
        ax.imshow(image, extent=extent, origin="lower", interpolation="none", zorder=0)
    for edge in range(len(graph.edges)):
        ax.plot(*np.array(points(graph, edge, graph.edges[edge].ends[0])).T, color=LINE, linewidth=1.0, zorder=1)
    driven = Counter(stop.edge for stop in run.stops[: last + 1] if stop.edge is not None)
    for edge, times in driven.items():
        line = np.array(points(graph, edge, graph.edges[edge].ends[0])).T
        ax.plot(*line, color=FINAL, linewidth=0.8 + 0.8 * min(times, 8), alpha=0.55, zorder=2, solid_capstyle="round")
    stop = run.stops[last]
    met = dict(zip(run.cameras, stop.cameras, strict=False))
    for number, node in enumerate(graph.nodes):
        known = not node.camera or number in met
        ax.plot(*node.position, "s" if node.camera else ".", color=INK if known else LINE, markersize=3.5, zorder=4)
        if number in met:
            ax.add_patch(_ellipse(node.position, met[number], REJECTED))
    ax.add_patch(_ellipse(graph.nodes[stop.node].position, stop.robot, ODOMETRY))
    ax.plot(*graph.nodes[stop.node].position, "o", color=ACCEPTED, markersize=6, zorder=5)


def _ellipse(at: tuple[float, float], covariance: tuple[float, float, float], colour: str) -> Ellipse:
    xx, xy, yy = covariance
    values, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    width, height = 2 * _ELLIPSE * np.sqrt(np.maximum(values, 0.0))
    angle = math.degrees(math.atan2(vectors[1, 0], vectors[0, 0]))
    return Ellipse(at, width, height, angle=angle, facecolor="none", edgecolor=colour, linewidth=1.1, zorder=3)


def _extent(graph: Graph) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    spots = [node.position for node in graph.nodes] + [bend for edge in graph.edges for bend in edge.via]
    low, high = np.min(spots, axis=0), np.max(spots, axis=0)
    margin = 0.08 * max(*(high - low), 10.0)
    return low - margin, high + margin


def _curve(ax: Axes, own: Sequence[Traded], colour: str) -> None:
    x, y = np.array([p.distance for p in own]), np.array([p.sigma for p in own])
    dx, dy = (np.nan_to_num([p.distance_band for p in own]), np.nan_to_num([p.sigma_band for p in own]))
    if own[0].weight is None:
        mark = MARKS.get(own[0].strategy, "o")
        ax.errorbar(x, y, dy, dx, fmt=mark, color=colour, markersize=6, elinewidth=0.8, zorder=4)
        return
    order = np.argsort(x)
    x, y, dy = x[order], y[order], dy[order]
    ax.fill_between(x, np.maximum(y - dy, 1e-6), y + dy, color=colour, alpha=0.15, linewidth=0, zorder=2)
    ax.plot(x, y, color=colour, marker=".", zorder=3)

"""Pictures of a drive before one camera: from above, what it gives as it goes on, and pixels before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groma.nouns.camera import Camera
from groma.nouns.poses import rotation_matrix
from groma.planning.camera import CameraPlan, Judged, Search, Stage
from groma.report.camera.pictures import draw_sigmas
from groma.report.drawing import ACCEPTED, FINAL, INK, LINE, MUTED, REJECTED, WIDTH, axes, drawn, sheet

_LEFT, _BOTTOM, _TOP = 0.55, 0.45, 0.3
_TICK = 0.14
"""Length of a mark of heading [m]."""
_TALLEST = 5.5


@drawn("The drive before the camera, from above")
def the_drive(stage: Stage, plan: CameraPlan, search: Search) -> Figure:
    """Draw the camera, what it sees of the floor's area, and the views with the headings of the robot."""
    far, side = search.depth[1] + 0.3, search.side + 0.3
    scale = min((WIDTH - _LEFT - 0.1) / (far + 0.4), _TALLEST / (2 * side))
    figure = sheet(2 * side * scale + _BOTTOM + 0.15)
    ax = axes(figure, _LEFT, _BOTTOM, (far + 0.4) * scale, 2 * side * scale)
    _draw_camera(ax, stage, far)
    near = search.depth[0]
    box = np.array([[near, -1], [search.depth[1], -1], [search.depth[1], 1], [near, 1], [near, -1]])
    ax.plot(box[:, 0], box[:, 1] * search.side, color=LINE, linewidth=1.0, linestyle=(0, (3, 2)))
    x, y, heading = plan.poses.T
    ax.plot(x, y, color=FINAL, linewidth=1.6)
    ends = np.array([x + _TICK * np.cos(heading), y + _TICK * np.sin(heading), np.full(len(x), np.nan)])
    starts = np.array([x, y, np.full(len(x), np.nan)])
    lines = np.stack([starts, ends], axis=2)[:2].reshape(2, -1, 2)
    ax.plot(*(np.column_stack([line, np.full(len(x), np.nan)]).ravel() for line in lines), color=MUTED, linewidth=0.9)
    ax.plot(x, y, ".", color=FINAL, markersize=5)
    ax.plot(x[:1], y[:1], "o", color=INK, markersize=6, markerfacecolor="none")
    ax.plot(x[-1:], y[-1:], "s", color=INK, markersize=6, markerfacecolor="none")
    ax.set(xlim=(-0.4, far), ylim=(-side, side), xlabel="before the camera [m]", ylabel="to the left [m]")
    return figure


def _draw_camera(ax: Axes, stage: Stage, far: float) -> None:
    """Draw the foot of the camera and the sides of its view."""
    camera = stage.camera
    middle = (camera.height - 1) / 2
    sides = camera.unproject(np.array([[0.0, middle], [camera.width - 1.0, middle]]))
    for direction in sides @ rotation_matrix(np.array(stage.mount[3:])).T:
        if np.isfinite(direction).all() and direction[0] > 0:
            slope = direction[1] / direction[0]
            ax.plot([0, 2 * far], [0, 2 * far * slope], color=LINE, linewidth=1.0)
    ax.plot([0], [0], "s", color=REJECTED, markersize=7)


@drawn("Worst pixel against what the wheels drive, and where other drives end")
def the_gain(plan: CameraPlan, ranking: Sequence[Judged], target: float) -> Figure:
    """Draw the worst pixel along the plan, the target, and the ends of common trajectories."""
    figure = sheet(3.4)
    ax = axes(figure, 0.65, _BOTTOM, WIDTH - 0.75, 2.8)
    effort = [stop.effort for stop in plan.stops]
    ax.plot(effort, [stop.worst for stop in plan.stops], color=FINAL, marker=".", markersize=4)
    ax.axhline(target, color=ACCEPTED, linewidth=0.9, linestyle=(0, (3, 2)))
    for judged in ranking:
        colour = REJECTED if judged.degenerate else INK
        ax.plot([judged.effort], [judged.worst], "x" if judged.degenerate else "D", color=colour, markersize=5)
        ax.annotate(
            judged.motion,
            (judged.effort, judged.worst),
            (4, 3),
            textcoords="offset points",
            fontsize=8.5,
            color=INK,
        )
    ax.set(yscale="log", xlabel="driven by the wheels, turns included [m]", ylabel="worst pixel, σ [px]")
    _plain_ticks(ax)
    ax.set_xlim(left=-0.1)
    ax.margins(x=0.12)
    return figure


@drawn("Standard deviation of pixels over the image, before and after the drive")
def before_and_after(camera: Camera, plan: CameraPlan) -> Figure:
    """Draw the standard deviation of projections over the image before the drive and after it, as contours."""
    across = (WIDTH - 2 * _LEFT - 0.2) / 2
    tall = min(across * camera.height / camera.width, _TALLEST)
    figure = sheet(tall + _BOTTOM + _TOP)
    for k, (title, covariance) in enumerate((("before", plan.before), ("after", plan.after))):
        ax = axes(figure, _LEFT + k * (across + _LEFT), _BOTTOM, tall * camera.width / camera.height, tall)
        draw_sigmas(ax, camera, np.array(covariance), levels=5)
        ax.set(xlim=(-0.5, camera.width - 0.5), ylim=(camera.height - 0.5, -0.5), title=title)
        ax.set(xlabel="across [px]", ylabel="down [px]" if k == 0 else "")
        ax.spines[["top", "right"]].set_visible(True)
    return figure


def _plain_ticks(ax: Axes) -> None:
    low, high = ax.get_ylim()
    ticks = [m * 10.0**e for e in range(-4, 5) for m in (1, 2, 5) if low <= m * 10.0**e <= high]
    ax.yaxis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.yaxis.set_ticks([], minor=True)
    ax.grid(axis="y", color=LINE, linewidth=0.4)

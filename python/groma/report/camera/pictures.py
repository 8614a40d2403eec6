"""The figures of the report on a camera, each a function from the result to an SVG element."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groma.cameras.calibration import CameraCalibration, projection_sigmas
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.report import drawing, words
from groma.report.camera.figures import used_pixels
from groma.report.drawing import FINAL, INK, LINE, MUTED, REJECTED, WIDTH, drawn

_LEFT, _BOTTOM, _TOP = 0.55, 0.45, 0.15
_MOST_DOTS = 4000
_LONGEST_ARROW = 0.04
"""Of the larger residuals, as a share of the image width."""


@drawn("Corners seen, over the image")
def coverage(found: CameraCalibration) -> Figure:
    """Draw where corners were seen, with their residuals as arrows."""
    figure, ax = _image(found)
    pixels, residuals = (_thinned(values) for values in used_pixels(found))
    scale = _LONGEST_ARROW * found.camera.width / max(float(np.quantile(np.hypot(*residuals.T), 0.99)), 1e-9)
    ends = pixels + residuals * scale
    ax.plot(
        np.column_stack([pixels[:, 0], ends[:, 0], np.full(len(pixels), np.nan)]).ravel(),
        np.column_stack([pixels[:, 1], ends[:, 1], np.full(len(pixels), np.nan)]).ravel(),
        color=REJECTED,
        linewidth=0.5,
        alpha=0.8,
    )
    ax.plot(*pixels.T, ".", color=FINAL, markersize=3.0, markeredgewidth=0)
    return figure


@drawn("Residuals of all corners used")
def residuals(found: CameraCalibration) -> Figure:
    """Draw the residuals against each other, and their distribution beside a normal one."""
    values = used_pixels(found)[1]
    sigma = float(np.sqrt(np.mean(values**2)))
    reach = max(4.5 * sigma, 1e-6)
    sheet = drawing.sheet(3.2)
    ax = drawing.axes(sheet, 0.75, _BOTTOM, 2.4, 2.4)
    ax.plot(*_thinned(values).T, ".", color=FINAL, markersize=2.0, markeredgewidth=0, alpha=0.6)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel="residual across [px]", ylabel="residual down [px]")
    ax.axhline(0, color=LINE, linewidth=0.8, zorder=0)
    ax.axvline(0, color=LINE, linewidth=0.8, zorder=0)
    _distribution(drawing.axes(sheet, 3.75, _BOTTOM, WIDTH - 3.85, 2.4), values.ravel(), sigma, reach)
    return sheet


def _distribution(ax: Axes, values: Array, sigma: float, reach: float) -> None:
    ax.hist(values, bins=60, range=(-reach, reach), density=True, color=FINAL, alpha=0.55)
    x = np.linspace(-reach, reach, 200)
    bell = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi)) if sigma > 0 else np.zeros(200)
    ax.plot(x, bell, color=INK, linewidth=1.0)
    ax.set(xlim=(-reach, reach), yticks=[], xlabel="residual [px]")
    ax.spines["left"].set_visible(False)


def draw_sigmas(ax: Axes, camera: Camera, covariance: Array, levels: int) -> None:
    """Draw contours of the standard deviation of projections, where it differs over the image."""
    at, sigmas = projection_sigmas(camera, covariance)
    if np.isfinite(sigmas).sum() > 3 and np.nanmax(sigmas) > 1.2 * np.nanmin(sigmas) > 0:
        steps = np.geomspace(np.nanmin(sigmas) * 1.05, np.nanmax(sigmas) * 0.95, levels)
        lines = ax.contour(at[..., 0], at[..., 1], sigmas, levels=steps, colors=[FINAL], linewidths=1.0)
        ax.clabel(lines, fmt=words.pixels, fontsize=8, colors=[INK])


@drawn("Projection uncertainty over the image")
def projection_map(found: CameraCalibration) -> Figure:
    """Draw the standard deviation of projections over the image, as contours."""
    figure, ax = _image(found)
    draw_sigmas(ax, found.camera, found.covariance, levels=7)
    ax.plot(
        *_thinned(used_pixels(found)[0]).T, ".", color=MUTED, markersize=2.5, markeredgewidth=0, alpha=0.6, zorder=0
    )
    return figure


@drawn("Residual of each view")
def views(found: CameraCalibration) -> Figure:
    """Draw the root mean square residual of every view."""
    sheet = drawing.sheet(2.2)
    ax = drawing.axes(sheet, _LEFT, _BOTTOM, WIDTH - _LEFT - 0.1, 1.6)
    rms = np.array([view.rms for view in found.views])
    taken = np.array([view.taken for view in found.views])
    place = np.arange(len(rms))
    ax.bar(place[taken], rms[taken], color=FINAL, width=0.8, alpha=0.75)
    ax.bar(place[~taken], rms[~taken], color=MUTED, width=0.8, alpha=0.75)
    ax.axhline(found.rms, color=INK, linewidth=0.8, linestyle=(0, (4, 2)))
    ax.set(xlim=(-0.8, len(rms) - 0.2), xlabel="view", ylabel="rms [px]")
    return sheet


def _image(found: CameraCalibration) -> tuple[Figure, Axes]:
    """Return axes in pixels of the image, y down."""
    width, height = found.camera.width, found.camera.height
    across = WIDTH - _LEFT - 0.1
    tall = min(across * height / width, 6.0)
    sheet = drawing.sheet(tall + _BOTTOM + _TOP)
    ax = drawing.axes(sheet, _LEFT, _BOTTOM, tall * width / height, tall)
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), xlabel="across [px]", ylabel="down [px]")
    ax.spines[["top", "right"]].set_visible(True)
    return sheet, ax


def _thinned(values: Array) -> Array:
    kept: Array = values[:: max(1, -(-len(values) // _MOST_DOTS))]
    return kept

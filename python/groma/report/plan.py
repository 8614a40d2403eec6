"""What every picture of a map needs: the walls as an image, axes in metres, a path, a curve along it.

Axes of maps are in metres, x to the right, y up, at one scale. Paths are thinned to what can be seen.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from groma.nouns.arrays import Array
from groma.nouns.maps import OccupancyGrid
from groma.report import drawing
from groma.report.drawing import INK, WIDTH

Extent = tuple[float, float, float, float]

LARGEST_IMAGE = 1400
"""Pixels along a side: twice what the page shows."""
SMALLEST_IMAGE = 700
"""Smaller maps are enlarged, for the page smooths what it scales."""

LEFT, RIGHT, BOTTOM, TOP = 0.55, 0.1, 0.45, 0.1
"""Margins of a sheet [inches]."""
_TALLEST = 1.2
_WALL, _UNKNOWN = 235, 38
"""Opacity of the ink."""


def shrunk(cells: NDArray[np.int8], factor: int) -> NDArray[np.int8]:
    """Return cells (h, w) of blocks (factor, factor): occupied when one is, else free when one is, else unknown."""
    height, width = (-(-size // factor) for size in cells.shape)
    padded = np.full((height * factor, width * factor), -1, dtype=np.int8)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    blocks: NDArray[np.int8] = padded.reshape(height, factor, width, factor).max(axis=(1, 3))
    return blocks


def walls(grid: OccupancyGrid) -> tuple[NDArray[np.uint8], Extent]:
    """Return the known part of the map as ink of some opacity (h, w, 4), and its extent [m]."""
    known = grid.cells >= 0
    rows, columns = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        rows, columns = np.array([0]), np.array([0])
    margin = 2 + max(len(rows), len(columns)) // 60
    bottom, top = max(rows[0] - margin, 0), min(rows[-1] + 1 + margin, grid.cells.shape[0])
    left, right = max(columns[0] - margin, 0), min(columns[-1] + 1 + margin, grid.cells.shape[1])
    factor = max(1, -(-max(top - bottom, right - left) // LARGEST_IMAGE))
    cells = shrunk(grid.cells[bottom:top, left:right], factor)
    image = np.zeros((*cells.shape, 4), dtype=np.uint8)
    image[..., 3] = np.select([cells < 0, cells >= 65], [_UNKNOWN, _WALL], 0)
    x, y, size = *grid.origin, grid.resolution
    height, width = (length * factor * size for length in cells.shape)
    enlarged = -(-SMALLEST_IMAGE // max(cells.shape))
    image = image.repeat(enlarged, axis=0).repeat(enlarged, axis=1)
    return image, (x + left * size, x + left * size + width, y + bottom * size, y + bottom * size + height)


def plan(extent: Extent) -> tuple[Figure, Axes]:
    """Return axes in metres at one scale that fill the width, or the height where the plan is tall."""
    width = WIDTH - LEFT - RIGHT
    aspect = (extent[3] - extent[2]) / (extent[1] - extent[0])
    height = min(width * aspect, WIDTH * _TALLEST)
    sheet = drawing.sheet(max(height, 1.0) + BOTTOM + TOP)
    ax = drawing.axes(sheet, LEFT, BOTTOM, height / aspect, height)
    ax.set(xlabel="x [m]", ylabel="y [m]")
    return sheet, ax


def draw_path(ax: Axes, poses: Array, colour: str, extent: Extent, **style: object) -> None:
    """Draw a path (N, 2 or more)."""
    step = max(extent[1] - extent[0], extent[3] - extent[2]) / 700
    xy = drawing.thinned(poses[:, :2], step)
    ax.plot(xy[:, 0], xy[:, 1], color=colour, **style)  # type: ignore[arg-type]


def draw_ends(ax: Axes, poses: Array) -> None:
    """Mark where a path starts and ends."""
    for pose, marker in ((poses[:1], "o"), (poses[-1:], "s")):
        ax.plot(pose[:, 0], pose[:, 1], marker, color=INK, markersize=5, markerfacecolor="none", markeredgewidth=1.2)


def draw_curve(ax: Axes, title: str, x: Array, y: Array, colour: str) -> None:
    """Draw a quantity that is not negative along the way."""
    ax.set_title(title)
    points = drawing.thinned(np.column_stack([x, y]), max(x.max(initial=0.0), 1.0) / 1500)
    ax.plot(points[:, 0], points[:, 1], color=colour)
    ax.set_ylim(0, max(1.15 * points[:, 1].max(initial=0.0), 1e-3))
    ax.locator_params(axis="y", nbins=4)

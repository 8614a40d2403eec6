"""Find the panels of a target in an image: AprilTag grids by the core, chessboards and ChArUco boards through OpenCV.

Corners of all kinds are fitted to the grey values by the core (docs/theory/camera_calibration.md) and carry a standard
deviation. OpenCV is imported only when a target has a board (``pip install groma[vision]``).
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.errors import UserError
from groma.io.opencv import load_opencv
from groma.nouns.arrays import Array, Gray
from groma.nouns.detection import Detection
from groma.nouns.target import Charuco, Chessboard, Panel, TagGrid, Target

VERSION = 1
"""Rises when the same image would give other corners: cached detections of another version are not used."""

LEFT_OUT = (
    "tags seen twice",
    "tags hardly legible",
    "tags too small",
    "tags at the border of the image",
    "tags of a blurred panel",
    "corners that could not be fitted",
)
_UNREFINED = 0.3
"""Standard deviation of a corner that is only where OpenCV puts it [pixel]."""
_USED_ROOM = 0.8
_FEWEST = 6
"""A board with fewer corners is not worth a pose."""


def detection_defaults() -> dict[str, object]:
    """Return the gates of detection with their defaults."""
    defaults: dict[str, object] = json.loads(_core.detection_defaults())
    return defaults


def detect(
    image: Gray,
    target: Target,
    *,
    camera: str = "camera",
    stamp: float = 0.0,
    gates: Mapping[str, object] | None = None,
) -> tuple[list[Detection], Counter[str]]:
    """Return what is seen of each panel, and counts of what was left out.

    Parameters
    ----------
    image
        (height, width) grey values.
    target
        The panels.
    camera, stamp
        Name and time that the detections bear.
    gates
        Those of :func:`detection_defaults`, changed.

    Raises
    ------
    UserError
        When a gate is unknown, there is no such family or dictionary, or OpenCV is needed and missing.
    """
    image = np.ascontiguousarray(image)
    try:
        options = json.dumps({**detection_defaults(), **(gates or {})})
        found = _core.find_tag_panels(image, target.json(), options)
    except ValueError as error:
        raise UserError(f"detection: {error}") from error
    detections, counts = [], Counter[str]()
    for place, ids, pixels, sigma, _, left_out in found:
        counts.update({name: count for name, count in zip(LEFT_OUT, left_out, strict=True) if count})
        if ids:
            name = target.panels[place].name
            detections.append(Detection(stamp, camera, name, np.array(ids), pixels.reshape(-1, 2), sigma))
    for panel in target.panels:
        board = None if isinstance(panel.pattern, TagGrid) else _board(image, panel, panel.pattern, counts)
        if board:
            detections.append(Detection(stamp, camera, panel.name, *board))
    return detections, counts


@dataclass(frozen=True, slots=True)
class Tag:
    """A tag that the detector found."""

    id: int
    mended: int
    """Bits of its code that were wrong."""
    margin: float
    """Mean distance of the bits from the threshold [grey]."""
    corners: Array
    """(4, 2) lower left, lower right, upper right, upper left of the tag as it is printed [pixel]."""


def detect_tags(image: Gray, family: str = "tag36h11", border: int = 1) -> list[Tag]:
    """Return all tags in an image, those seen more than once too, by the detector alone.

    Parameters
    ----------
    image
        (height, width) grey values.
    family
        Such as ``tag36h11``.
    border
        Width of the black border in modules: 1, or 2 as Kalibr prints it.

    Raises
    ------
    UserError
        When there is no such family or border.
    """
    try:
        found = _core.detect_tags(np.ascontiguousarray(image), family, border)
    except ValueError as error:
        raise UserError(f"detection: {error}") from error
    return [Tag(number, mended, margin, np.reshape(corners, (4, 2))) for number, mended, margin, corners in found]


def drawings(grid: TagGrid) -> list[Gray]:
    """Return what is printed in the squares of a grid, tag by tag: (modules, modules), 0 black, 1 white.

    Raises
    ------
    ValueError
        When there is no such family, tag or border.
    """
    flat = _core.tag_drawings(msgspec.json.encode(grid).decode())
    return [np.array(tag, dtype=np.uint8).reshape(int(np.sqrt(len(tag))), -1) for tag in flat]


def _board(
    image: Gray, panel: Panel, pattern: Charuco | Chessboard, counts: Counter[str]
) -> tuple[NDArray[np.int64], Array, Array] | None:
    """Return numbers, pixels and sigmas of the corners of a board."""
    cv2 = load_opencv(f"panel {panel.name} is a board")
    found = _charuco(cv2, image, pattern) if isinstance(pattern, Charuco) else _chessboard(cv2, image, pattern)
    if found is None or len(found[0]) < _FEWEST:
        return None
    ids, pixels = found
    points = panel.corners[ids][:, :2]
    matrix, _ = cv2.findHomography(points, pixels, cv2.RANSAC, 4.0)
    if matrix is None:
        return None
    directions, steps = _edges(np.asarray(matrix, dtype=np.float64), points, panel.corners[1, 0] - panel.corners[0, 0])
    refined, sigma, _ = _core.refine_corners(image, pixels, directions, _USED_ROOM * _free_share(pattern) * steps)
    refined = refined.reshape(-1, 2)
    good = np.isfinite(sigma)
    counts.update({LEFT_OUT[-1]: int((~good).sum())})
    return ids, np.where(good[:, None], refined, pixels), np.where(good, sigma, _UNREFINED)


def _free_share(pattern: Charuco | Chessboard) -> float:
    """Return how far around a corner nothing else is printed, as a share of the square."""
    if isinstance(pattern, Charuco):
        return float(np.sqrt(0.5)) * (1 - pattern.marker / pattern.square)
    return 1.0


def _edges(matrix: Array, points: Array, square: float) -> tuple[Array, Array]:
    """Return the directions (k, 4) of the edges in the image, and the shorter side (k,) of a square there [pixel]."""
    ahead = [
        _through(matrix, points + np.array(step)) for step in ((square, 0), (-square, 0), (0, square), (0, -square))
    ]
    along, across = ahead[0] - ahead[1], ahead[2] - ahead[3]
    lengths = np.minimum(np.hypot(*along.T), np.hypot(*across.T)) / 2
    return np.column_stack([along, across]), lengths


def _through(matrix: Array, points: Array) -> Array:
    image = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    pixels: Array = image[:, :2] / image[:, 2:]
    return pixels


def _chessboard(cv2: ModuleType, image: Gray, board: Chessboard) -> tuple[NDArray[np.int64], Array] | None:
    size = (board.columns, board.rows)
    found, corners = cv2.findChessboardCorners(
        image, size, None, cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    )
    if found:
        window = (5, 5) if min(image.shape) > 100 else (2, 2)
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 30, 0.01)
        corners = cv2.cornerSubPix(image, corners, window, (-1, -1), criteria)
    else:
        found, corners = cv2.findChessboardCornersSB(image, size, None, cv2.CALIB_CB_EXHAUSTIVE)
    if not found or corners is None:
        return None
    return np.arange(board.columns * board.rows), np.asarray(corners, dtype=np.float64).reshape(-1, 2)


def _charuco(cv2: ModuleType, image: Gray, board: Charuco) -> tuple[NDArray[np.int64], Array] | None:
    kind = getattr(cv2.aruco, board.dictionary, None)
    if not board.dictionary.startswith("DICT_") or kind is None:
        raise UserError(f"no dictionary is called {board.dictionary!r}: take a name of OpenCV such as DICT_6X6_250")
    ids = np.arange(board.first_id, board.first_id + board.columns * board.rows // 2)
    dictionary = cv2.aruco.getPredefinedDictionary(kind)
    drawn = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square, board.marker, dictionary, ids)
    drawn.setLegacyPattern(board.legacy)
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(drawn).detectBoard(image)
    if numbers is None:
        return None
    order = np.argsort(numbers.ravel())
    return numbers.ravel()[order].astype(np.int64), np.asarray(corners, dtype=np.float64).reshape(-1, 2)[order]

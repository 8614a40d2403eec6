"""What a camera node does with an image: detect, and put the corners as they travel."""

from __future__ import annotations

import numpy as np

from groma.cameras.vision import detect
from groma.io.camera_protocol import Corners
from groma.link.node import Detect
from groma.link.sources import Grey
from groma.nouns.detection import Detection
from groma.nouns.target import Target


def sight(target: Target) -> Detect:
    """Return the detector of a target's panels.

    Raises
    ------
    UserError
        When the target has a board and OpenCV is missing, or a tag family is unknown.
    """
    detect(np.zeros((16, 16), np.uint8), target)  # what is missing shows now, not at the first stop

    def see(image: Grey) -> tuple[tuple[Corners, ...], int]:
        detections, left_out = detect(image, target)
        return tuple(map(corners, detections)), sum(left_out.values())

    return see


def corners(seen: Detection) -> Corners:
    """Return the corners of a panel as they travel."""
    return Corners(
        panel=seen.panel,
        ids=tuple(map(int, seen.corners)),
        u=tuple(map(float, seen.pixels[:, 0])),
        v=tuple(map(float, seen.pixels[:, 1])),
        sigma=tuple(map(float, seen.sigma)),
    )

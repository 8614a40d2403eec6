"""What a camera saw of a panel at one time: a frozen value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Detection:
    """Corners of one panel in one image."""

    stamp: float
    """Time of the exposure [s]."""
    camera: str
    """Name of the camera."""
    panel: str
    """Name of the panel."""
    corners: NDArray[np.int64]
    """(k,) numbers of the corners, rising."""
    pixels: NDArray[np.float64]
    """(k, 2) where they are; the centre of the upper left pixel is (0, 0)."""
    sigma: NDArray[np.float64]
    """(k,) standard deviation of a coordinate [pixel]."""

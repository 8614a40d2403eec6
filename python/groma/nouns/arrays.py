"""The arrays that groma passes around."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Gray = NDArray[np.uint8]
"""(height, width), a grey image."""


def shaped(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Return values as a contiguous array of a shape.

    Raises
    ------
    ValueError
        If they have another.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}: it must be {shape}")
    return array

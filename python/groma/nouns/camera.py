"""A camera in numpy terms: points to pixels and back.

Frame: z along the optical axis, x to the right of the image, y down. The centre of the upper left pixel is (0, 0).
Formulas of the lens models: docs/theory/camera_calibration.md.
"""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.nouns.arrays import Array

LENSES: dict[str, tuple[str, ...]] = {name: tuple(parameters) for name, parameters in _core.camera_lenses()}
"""Names of the parameters of every lens model, in order."""


class Camera(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A camera; a frozen value.

    Examples
    --------
    >>> camera = Camera(640, 480, "radtan", (600.0, 600.0, 319.5, 239.5, -0.2, 0.05, 0.0, 0.0))
    >>> camera.project(np.array([[0.0, 0.0, 2.0]]))
    array([[319.5, 239.5]])
    """

    width: int
    """Columns of the image."""
    height: int
    """Rows of the image."""
    lens: str
    """A key of :data:`LENSES`."""
    parameters: tuple[float, ...]
    """fx, fy, cx, cy [pixel], then those of the lens."""

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises
        ------
        ValueError
            When the lens is unknown, takes another number of parameters, or a number is out of range.
        """
        if self.lens not in LENSES:
            raise ValueError(f"no lens is called {self.lens!r}: there are {', '.join(LENSES)}")
        self.project(np.empty((0, 3)))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return LENSES[self.lens]

    @property
    def matrix(self) -> Array:
        """The (3, 3) camera matrix."""
        fx, fy, cx, cy = self.parameters[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def project(self, points: Array) -> Array:
        """Return the pixels (m, 2) of points (m, 3) in the frame of the camera [m]; NaN where it does not see one.

        A pixel may lie beside the image: see :meth:`holds`.
        """
        return _core.camera_project(self.json(), np.asarray(points, dtype=np.float64).reshape(-1, 3))

    def unproject(self, pixels: Array) -> Array:
        """Return the directions (m, 3) of length 1 that pixels (m, 2) see; NaN where the lens model does not reach."""
        return _core.camera_unproject(self.json(), np.asarray(pixels, dtype=np.float64).reshape(-1, 2))

    def holds(self, pixels: Array) -> NDArray[np.bool_]:
        """Return which pixels (m, 2) lie in the image."""
        size = np.array([self.width, self.height])
        inside: NDArray[np.bool_] = np.all((pixels >= -0.5) & (pixels <= size - 0.5), axis=1)
        return inside

    def json(self) -> str:
        """Return it as the core takes it."""
        return msgspec.json.encode(self).decode()

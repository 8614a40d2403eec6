"""Images of targets that do not exist: lens, blur and noise, so that the real detector can run on them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from groma import _core
from groma.nouns.arrays import Array, Gray
from groma.nouns.camera import Camera
from groma.nouns.target import Target


class Appearance(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How an image looks."""

    white: float
    """Grey of white paper."""
    black: float
    """Grey of black print."""
    blur: float
    """Standard deviation of the blur [pixel]."""
    noise: float
    """Standard deviation of the noise [grey]."""


def appearance(**changes: float) -> Appearance:
    """Return the default appearance with changes.

    Examples
    --------
    >>> appearance(noise=0.0).blur
    0.7
    """
    defaults: Mapping[str, float] = json.loads(_core.appearance_defaults())
    return msgspec.convert({**defaults, **changes}, Appearance)


def render(
    camera: Camera, target: Target, poses: Sequence[Array], look: Appearance | None = None, seed: int = 1
) -> Gray:
    """Return the image (height, width) of a target.

    Parameters
    ----------
    camera
        The camera.
    target
        Its panels; grids of tags and chessboards.
    poses
        ``T_camera_panel`` (4, 4) of each panel.
    look
        See :func:`appearance`.
    seed
        Draws the noise.

    Raises
    ------
    ValueError
        When a panel cannot be drawn or a setting makes no sense.
    """
    json_look = msgspec.json.encode(look or appearance()).decode()
    stacked = np.ascontiguousarray(np.stack([*poses])) if len(poses) else np.empty((0, 4, 4))
    return _core.render_target(camera.json(), target.json(), stacked, json_look, seed).reshape(
        camera.height, camera.width
    )

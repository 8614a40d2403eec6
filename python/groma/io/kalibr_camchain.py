"""Cameras as Kalibr keeps them: camchain.yaml.

A camera has camera_model pinhole, distortion_model none, radtan (k1 k2 p1 p2) or equidistant (k1..k4), and from the
second one on T_cn_cnm1, which takes coordinates in the camera before it to its own. A lens with more coefficients has
no place in the file. Kalibr's omni, eucm and ds cameras are refused.

Source: github.com/ethz-asl/kalibr/wiki/yaml-formats.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.yaml_file import converted, read_yaml
from groma.nouns.camera import Camera

_LENSES = {"none": "pinhole", "radtan": "radtan", "equidistant": "equidistant"}
_MODELS = {lens: model for model, lens in _LENSES.items()}


class _Entry(msgspec.Struct):
    camera_model: str
    intrinsics: list[float]
    distortion_model: str
    resolution: tuple[int, int]
    distortion_coeffs: list[float] = []
    rostopic: str = ""


def holds(camera: Camera) -> bool:
    """Return whether Kalibr has a name for the lens."""
    return camera.lens in _MODELS


def read_camchain(path: Path) -> dict[str, Camera]:
    """Read the cameras by their topics, or by their keys (cam0, cam1, ...) where there is no topic.

    Raises
    ------
    UserError
        When the file cannot be read or holds a camera of another kind.
    """
    entries = converted(path, read_yaml(path), dict[str, _Entry], "a camchain of Kalibr")
    return {entry.rostopic or key: _camera(path, key, entry) for key, entry in entries.items()}


def write_camchain(
    path: Path, cameras: Mapping[str, Camera], chain: Mapping[str, NDArray[np.float64]] | None = None
) -> None:
    """Write cameras in their order.

    Parameters
    ----------
    path
        The file.
    cameras
        By topic.
    chain
        T_cn_cnm1 as (4, 4), by topic.

    Raises
    ------
    ValueError
        When Kalibr has no name for a lens.
    """
    write_text(path, "".join(_entry(k, name, cameras[name], (chain or {}).get(name)) for k, name in enumerate(cameras)))


def _camera(path: Path, key: str, entry: _Entry) -> Camera:
    lens = _LENSES.get(entry.distortion_model)
    if entry.camera_model != "pinhole" or lens is None:
        model = f"{entry.camera_model}-{entry.distortion_model}"
        raise UserError(f"{path}: {key} is {model}: must be pinhole with {', '.join(_LENSES)}")
    coefficients = [] if lens == "pinhole" else entry.distortion_coeffs
    try:
        return Camera(*entry.resolution, lens, (*entry.intrinsics, *coefficients))
    except ValueError as error:
        raise UserError(f"{path}: {key}: {error}") from error


def _entry(index: int, topic: str, camera: Camera, before: NDArray[np.float64] | None) -> str:
    if not holds(camera):
        raise ValueError(f"Kalibr has no lens {camera.lens}")
    lines = [
        "camera_model: pinhole",
        f"intrinsics: [{', '.join(map(repr, camera.parameters[:4]))}]",
        f"distortion_model: {_MODELS[camera.lens]}",
        f"distortion_coeffs: [{', '.join(map(repr, camera.parameters[4:]))}]",
        f"resolution: [{camera.width}, {camera.height}]",
        f"rostopic: {msgspec.json.encode(topic).decode()}",
    ]
    if before is not None:
        lines += ["T_cn_cnm1:", *(f"- [{', '.join(map(repr, row))}]" for row in before.tolist())]
    return f"cam{index}:\n" + "".join(f"  {line}\n" for line in lines)

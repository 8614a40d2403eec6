"""Intrinsics as ROS keeps them: the yaml of camera_calibration_parsers, read by camera_info_manager and image_proc.

| distortion_model | coefficients | lens |
|---|---|---|
| plumb_bob | k1 k2 p1 p2 k3 | plumb_bob; pinhole and radtan are written so, with zeros |
| rational_polynomial | k1 k2 p1 p2 k3 k4 k5 k6 | rational |
| equidistant, fisheye | k1 k2 k3 k4 | equidistant |

The rectification is the identity and the projection the camera matrix, as of a camera that is no part of a stereo pair.
A file that says otherwise is read for its intrinsics alone. Source: sensor_msgs/CameraInfo, distortion_models.hpp.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.yaml_file import converted, read_yaml
from groma.nouns.camera import Camera

_LENSES = {
    "plumb_bob": "plumb_bob",
    "rational_polynomial": "rational",
    "equidistant": "equidistant",
    "fisheye": "equidistant",
}
_MODELS = {
    "pinhole": ("plumb_bob", 5),
    "radtan": ("plumb_bob", 5),
    "plumb_bob": ("plumb_bob", 5),
    "rational": ("rational_polynomial", 8),
    "equidistant": ("equidistant", 4),
}


class _Table(msgspec.Struct):
    data: list[float]


class _CameraInfo(msgspec.Struct):
    image_width: int
    image_height: int
    camera_matrix: _Table
    distortion_model: str
    distortion_coefficients: _Table
    camera_name: str = ""


def read_camera_info(path: Path) -> tuple[str, Camera]:
    """Read the name of a camera (may be empty) and its intrinsics.

    Raises
    ------
    UserError
        When the file cannot be read, has another distortion model, or a skew.
    """
    info = converted(path, read_yaml(path), _CameraInfo, "a camera_info of ROS")
    lens = _LENSES.get(info.distortion_model)
    if lens is None:
        raise UserError(f"{path}: distortion_model {info.distortion_model!r}: must be one of {', '.join(_LENSES)}")
    if len(info.camera_matrix.data) != 9 or info.camera_matrix.data[1] != 0.0:
        raise UserError(f"{path}: camera_matrix must have nine numbers and no skew")
    fx, _, cx, _, fy, cy = info.camera_matrix.data[:6]
    coefficients = _padded(info.distortion_coefficients.data, _MODELS[lens][1])
    try:
        camera = Camera(info.image_width, info.image_height, lens, (fx, fy, cx, cy, *coefficients))
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error
    return info.camera_name, camera


def write_camera_info(path: Path, name: str, camera: Camera) -> None:
    """Write the intrinsics of a camera; all digits are kept."""
    fx, fy, cx, cy, *coefficients = camera.parameters
    model, count = _MODELS[camera.lens]
    text = (
        f"image_width: {camera.width}\nimage_height: {camera.height}\ncamera_name: {_quoted(name)}\n"
        + _table("camera_matrix", 3, 3, [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])
        + f"distortion_model: {model}\n"
        + _table("distortion_coefficients", 1, count, _padded(coefficients, count))
        + _table("rectification_matrix", 3, 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
        + _table("projection_matrix", 3, 4, [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0])
    )
    write_text(path, text)


def _padded(coefficients: list[float], count: int) -> list[float]:
    return coefficients + [0.0] * (count - len(coefficients))


def _table(name: str, rows: int, columns: int, values: list[float]) -> str:
    return f"{name}:\n  rows: {rows}\n  cols: {columns}\n  data: [{', '.join(map(repr, values))}]\n"


def _quoted(name: str) -> str:
    return msgspec.json.encode(name).decode()

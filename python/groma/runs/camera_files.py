"""The files of a calibrated camera.

| file | what |
|---|---|
| NAME.yaml | intrinsics as ROS keeps them |
| NAME.json | parameters and the covariance to pass on; both together are a camera of a network survey |
| camchain.yaml | Kalibr, when it has the lens |
"""

from __future__ import annotations

import json
from pathlib import Path

from groma.cameras.calibration import CameraCalibration
from groma.io.atomic import write_text
from groma.io.camera_info import write_camera_info
from groma.io.kalibr_camchain import holds, write_camchain


def save_camera(
    name: str,
    found: CameraCalibration,
    directory: Path,
) -> None:
    """Write the files of a calibrated camera into a folder that exists.

    Raises
    ------
    UserError
        When a file cannot be written.
    """
    write_camera_info(directory / f"{name}.yaml", name, found.camera)
    write_text(directory / f"{name}.json", _covariance(found))
    if holds(found.camera):
        write_camchain(directory / "camchain.yaml", {name: found.camera})


def _covariance(found: CameraCalibration) -> str:
    content = {
        "version": 1,
        "lens": found.camera.lens,
        "width": found.camera.width,
        "height": found.camera.height,
        "parameters": list(found.camera.names),
        "values": list(found.camera.parameters),
        "covariance": found.covariance.tolist(),
        "claimed_covariance": found.claimed.tolist(),
        "honesty_factor": found.honesty.factor,
    }
    return json.dumps(content, indent=1) + "\n"

"""The files of a calibrated camera.

| file | what |
|---|---|
| NAME.yaml | intrinsics as ROS keeps them |
| NAME.json | parameters and the covariance to pass on; both together are a camera of a network survey |
| camchain.yaml | Kalibr, when it has the lens |
| metrics.json, run.toml, report.html | figures, what made them, a page to read |
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from groma.camera_calibration import CameraCalibration
from groma.camera_images import Sightings
from groma.io.atomic import write_text
from groma.io.camera_info import write_camera_info
from groma.io.kalibr_camchain import holds, write_camchain
from groma.io.results import run_record
from groma.io.toml import to_toml
from groma.report.camera_figures import camera_figures
from groma.report.camera_report import camera_report


def save_camera(
    name: str,
    found: CameraCalibration,
    sightings: Sightings,
    settings: Mapping[str, object],
    source: Path,
    directory: Path,
    command: str,
) -> None:
    """Write all files of a calibrated camera; the report comes last.

    Raises
    ------
    UserError
        When a file cannot be written.
    """
    run = run_record(settings, source, command)
    write_camera_info(directory / f"{name}.yaml", name, found.camera)
    write_text(directory / f"{name}.json", _covariance(found))
    if holds(found.camera):
        write_camchain(directory / "camchain.yaml", {name: found.camera})
    write_text(
        directory / "metrics.json", json.dumps(camera_figures(found, sightings), indent=1, sort_keys=True) + "\n"
    )
    write_text(directory / "run.toml", to_toml(run))
    write_text(directory / "report.html", camera_report(name, found, sightings, run))


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

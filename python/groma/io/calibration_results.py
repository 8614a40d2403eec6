"""The files that the calibration of a vehicle leaves, the report last; see :mod:`groma.io.results`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from groma.io.atomic import write_text
from groma.io.results import run_record
from groma.io.robot_files import ros2_control, urdf_joint
from groma.io.toml import to_toml
from groma.io.vehicle_file import vehicle_text
from groma.report.calibration_figures import calibration_figures, motion_table, shown_vehicle
from groma.report.calibration_report import calibration_report
from groma.vehicle_calibration import CalibratedVehicle


def save_calibration(
    result: CalibratedVehicle,
    settings: Mapping[str, object],
    source: Path | None,
    directory: Path,
    command: str | None = None,
) -> None:
    """Write all files of a calibration; those of the vehicle only where the drive leaves nothing open.

    Parameters
    ----------
    result
        The calibration.
    settings
        Every setting by name, tables nested.
    source
        The recording; None when there is none.
    directory
        Exists.
    command
        The command line, without what does not bear on the result.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    run = run_record(settings, source, command)
    vehicle = shown_vehicle(result)
    names = ("vehicle.toml", "laser.urdf.xml", "ros2_control.yaml")
    if vehicle is None:
        for name in names:
            (directory / name).unlink(missing_ok=True)
    else:
        made = (vehicle_text(vehicle), urdf_joint(vehicle), ros2_control(vehicle))
        for name, content in zip(names, made, strict=True):
            write_text(directory / name, content)
    write_text(directory / "motions.csv", motion_table(result))
    figures = json.dumps(calibration_figures(result), indent=1, sort_keys=True, allow_nan=False)
    write_text(directory / "metrics.json", figures + "\n")
    write_text(directory / "run.toml", to_toml(run))
    write_text(directory / "report.html", calibration_report(result, run))

"""The files that the calibration of a vehicle leaves beside what every run leaves."""

from __future__ import annotations

from pathlib import Path

from groma.io.atomic import write_text
from groma.io.robot_files import ros2_control, urdf_joint
from groma.io.vehicle_file import vehicle_text
from groma.report.vehicle.figures import motion_table, shown_vehicle
from groma.vehicle.recording import CalibratedVehicle


def save_calibration(result: CalibratedVehicle, directory: Path) -> None:
    """Write the files of a calibration into a folder that exists; those of the vehicle only where nothing is open.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    vehicle = shown_vehicle(result)
    if vehicle is not None:
        write_text(directory / "vehicle.toml", vehicle_text(vehicle))
        write_text(directory / "laser.urdf.xml", urdf_joint(vehicle))
        write_text(directory / "ros2_control.yaml", ros2_control(vehicle))
    write_text(directory / "motions.csv", motion_table(result))

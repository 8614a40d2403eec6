"""A drive whose odometry comes from the wheels of a calibrated vehicle, its laser where calibration found it.

The wheels are read as for calibration (:mod:`groma.io.wheels`), summed on exact arcs, and brought to the clock of the
scans by the delay. Where the readings are broken the odometry goes on from where it stopped: the mapper sees a stall.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from groma.errors import UserError
from groma.io.drive import Drive, open_drive
from groma.io.recording import Recording
from groma.io.wheels import read_wheels
from groma.models import LaserScan, Odometry
from groma.vehicle import Vehicle

STREAM = "wheels"
_OF_VEHICLE = ("mount-unknown", "mount-found", "odometry-missing")
"""What the vehicle file says: findings on it do not hold."""
AHEAD = 1.0
"""Odometry is handed on this far ahead of a scan, so that it covers the sweep [s]."""


@dataclass(slots=True)
class WheelDrive(Drive):
    """Scans of a recording with odometry from its wheels."""

    poses: list[Odometry] = field(default_factory=list)

    def events(self) -> Iterator[Odometry | LaserScan]:
        """Yield scans in the order of the file, the odometry ahead of them."""
        waiting = iter(self.poses)
        pose = next(waiting, None)
        for message in self.recording.messages({self.scans}):
            if isinstance(message, LaserScan) and message.stream == self.scans:
                while pose is not None and pose.stamp <= message.stamp + AHEAD:
                    yield pose
                    pose = next(waiting, None)
                yield self._upright(message)
        while pose is not None:
            yield pose
            pose = next(waiting, None)


def open_wheel_drive(recording: Recording, vehicle: Vehicle, *, scans: str | None = None) -> WheelDrive:
    """Open a drive of a calibrated vehicle.

    Parameters
    ----------
    recording
        An open recording with wheels and scans.
    vehicle
        What drove.
    scans
        Name of the scan stream; chosen when None.

    Raises
    ------
    UserError
        When there are no scans, or no wheels of the vehicle.
    """
    drive = open_drive(recording, scans=scans, odometry="none")
    wheels = read_wheels(recording, vehicle.model, joints=vehicle.joints)
    if wheels.unit != vehicle.unit:
        raise UserError(
            f"{recording.path}: its wheels are read in {wheels.unit}, those of the vehicle in {vehicle.unit}"
        )
    stamps = wheels.time - vehicle.parameters["delay"]
    poses = wheels.dead_reckoning(vehicle)
    x, y, yaw = vehicle.laser
    return WheelDrive(
        recording,
        drive.scans,
        STREAM,
        replace(drive.mount, x=x, y=y, yaw=yaw),
        mount_known=True,
        notes=[
            *(note for note in drive.notes if note.code not in _OF_VEHICLE),
            *wheels.findings,
        ],
        poses=[Odometry(t, STREAM, *pose) for t, pose in zip(stamps.tolist(), poses.tolist(), strict=True)],
    )

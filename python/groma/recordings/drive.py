"""A drive: the one scan and the one odometry stream of a recording that a map is made of, in the order of the file.

Of a calibrated vehicle the readings of its wheels take the place of odometry, and its laser sits where it was found.

Choice when not told: the scan stream with most messages; the odometry on the scan lines themselves (CARMEN), else the
Odometry stream with most messages, else a moving ``odom -> base`` edge of /tf. What was chosen among several is noted.

Mounting: the chain of transforms from the frame of the vehicle (the odometry's child frame) to that of the laser; see
``mounting.py``. Scans of a scanner that hangs upside down are mirrored, and all scans leave here with bearings that
grow: ``T_base_laser`` is then (x, y, yaw) and nothing else. Reversed scans keep their timing (negative time_increment).

Order: messages leave here as the recording has them; what to do with late ones is the core's. A look at the beginning
tells how late they come: ``Drive.lateness`` is what a recording whose stamps are disordered asks the core to wait.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from groma.errors import UserError
from groma.io.recording import Recording
from groma.nouns.findings import Finding
from groma.nouns.messages import JointState, LaserScan, Odometry, Transform
from groma.nouns.poses import yaw_of
from groma.nouns.vehicle import Vehicle
from groma.recordings.disorder import needed_lateness
from groma.recordings.drive_choice import TF, Look, choose_odometry, choose_scans, look, mount_for
from groma.recordings.mounting import Mount
from groma.recordings.wheels import WheelChoice, choose_wheels

WHEELS = "wheels"
"""Name of the odometry that is made of wheels."""
_OF_VEHICLE = ("mount-unknown", "mount-found", "odometry-missing", "stamps-disordered")
"""What the vehicle file says: findings on it do not hold."""


@dataclass(slots=True)
class Drive:
    """What ``groma map`` consumes."""

    recording: Recording
    scans: str
    """Name of the scan stream."""
    odometry: str | None
    """Name of the odometry stream; None when there is none or none was wanted."""
    mount: Mount
    """T_base_laser: ``.x``, ``.y`` [m], ``.yaw`` [rad]."""
    mount_known: bool
    """Whether the recording says where the laser sits."""
    notes: list[Finding]
    """What was chosen and assumed."""
    lateness: float = 0.0
    """How late messages come, by a look at the beginning [s]; 0 where they are in order."""
    vehicle: Vehicle | None = None
    """What drove, where its wheels are read."""
    wheels: WheelChoice | None = None
    """Which messages are the readings of its wheels."""
    _edge: tuple[str, str] | None = None

    def events(self) -> Iterator[Odometry | JointState | LaserScan]:
        """Yield scans, odometry or wheels in the order in which they came; may be called again for another pass."""
        from_tf, motions = self._edge is not None, self.wheels.stream if self.wheels else self.odometry
        names = {self.scans} if motions is None or from_tf else {self.scans, motions}
        if from_tf:
            names |= {stream.name for stream in self.recording.streams if stream.kind == "transform"}
        for message in self.recording.messages(names):
            if isinstance(message, LaserScan):
                if message.stream == self.scans:
                    yield self._upright(message)
            elif isinstance(message, Odometry | JointState):
                if message.stream == motions:
                    yield message
            elif from_tf and isinstance(message, Transform) and (message.parent, message.child) == self._edge:
                yield _odometry(message)

    def findings(self) -> list[Finding]:
        """Return what was chosen and assumed; the recording has its own besides, the core what it left out."""
        return list(self.notes)

    def _upright(self, scan: LaserScan) -> LaserScan:
        if self.mount.upside_down:
            scan = _mirrored(scan)
        return _reversed(scan) if scan.geometry.angle_increment < 0 else scan


def open_drive(recording: Recording, *, scans: str | None = None, odometry: str | None = None) -> Drive:
    """Choose the streams of a drive and find out where the laser sits.

    Parameters
    ----------
    recording
        An open recording.
    scans
        Name of the scan stream; chosen when None.
    odometry
        Name of the odometry stream, ``"tf"`` for the odom edge of /tf, ``"none"`` for no odometry; chosen when None.

    Raises
    ------
    UserError
        When there is no scan stream, or none of the name requested; the message lists those there are.
    """
    notes: list[Finding] = []
    scan_name = choose_scans(recording, scans, notes)
    odometry_name = choose_odometry(recording, odometry, scan_name, notes)
    found = look(recording, scan_name, odometry_name)
    edge = _tf_odometry(odometry, odometry_name, found, notes)
    base = found.base or (edge[1] if edge else None)
    mount = mount_for(found, base, notes)
    named = f"{TF}:{edge[0]}->{edge[1]}" if edge else odometry_name
    drive = Drive(recording, scan_name, named, mount or Mount(), mount is not None, notes, _edge=edge)
    _wait(drive)
    return drive


def open_vehicle_drive(recording: Recording, vehicle: Vehicle, *, scans: str | None = None) -> Drive:
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
    wheels = choose_wheels(recording, vehicle.model, joints=vehicle.joints)
    if wheels.unit != vehicle.unit:
        raise UserError(
            f"{recording.path}: its wheels are read in {wheels.unit}, those of the vehicle in {vehicle.unit}"
        )
    x, y, yaw = vehicle.laser
    drive.odometry, drive.vehicle, drive.wheels = WHEELS, vehicle, wheels
    drive.mount, drive.mount_known = replace(drive.mount, x=x, y=y, yaw=yaw), True
    drive.notes = [*(note for note in drive.notes if note.code not in _OF_VEHICLE), *wheels.findings]
    _wait(drive)
    return drive


def _wait(drive: Drive) -> None:
    """Ask for the time that messages must wait to be put into order, and say so."""
    delay = drive.vehicle.parameters["delay"] if drive.vehicle else 0.0
    drive.lateness = needed_lateness(drive.events(), delay)
    if drive.lateness:
        text = f"stamps are disordered: messages wait up to {drive.lateness:.3g} s to be put into order"
        drive.notes.append(Finding("stamps-disordered", text, values={"lateness": (drive.lateness, "s")}))


def _tf_odometry(wanted: str | None, chosen: str | None, found: Look, notes: list[Finding]) -> tuple[str, str] | None:
    if chosen is not None or wanted == "none":
        return None
    edge = found.odometry_edge()
    if edge:
        notes.append(Finding("stream-chosen", f"odometry from the transform {edge[0]} -> {edge[1]}"))
    else:
        notes.append(Finding("odometry-missing", "no odometry in the recording"))
    return edge


def _mirrored(scan: LaserScan) -> LaserScan:
    """Return the scan as seen from above when the scanner hangs upside down: beams turn the other way."""
    g = scan.geometry
    return replace(scan, geometry=replace(g, angle_min=-g.angle_min, angle_increment=-g.angle_increment))


def _reversed(scan: LaserScan) -> LaserScan:
    """Return the same scan with its last beam first."""
    g, last = scan.geometry, len(scan.ranges) - 1
    turned = replace(
        g,
        angle_min=g.angle_min + last * g.angle_increment,
        angle_increment=-g.angle_increment,
        time_increment=-g.time_increment,
    )
    stamp = scan.stamp + last * g.time_increment
    return replace(
        scan, stamp=stamp, geometry=turned, ranges=scan.ranges[::-1].copy(), intensities=scan.intensities[::-1].copy()
    )


def _odometry(edge: Transform) -> Odometry:
    (x, y, _), theta = edge.translation, yaw_of(edge.quaternion)
    return Odometry(edge.stamp, edge.stream, x, y, theta, edge.parent, edge.child)

"""A drive: the one scan stream and the one odometry stream of a recording that a map is made of, in order of time.

Choice when not told: the scan stream with most messages; the odometry on the scan lines themselves (CARMEN), else the
Odometry stream with most messages, else a moving ``odom -> base`` edge of /tf. What was chosen among several is noted.

Mounting: the chain of transforms from the frame of the vehicle (the odometry's child frame) to that of the laser; see
``mounting.py``. Scans of a scanner that hangs upside down are mirrored, and all scans leave here with bearings that
grow: ``T_base_laser`` is then (x, y, yaw) and nothing else. Reversed scans keep their timing (negative time_increment).

Order: a scan counts as of the time of its last beam, so odometry up to the end of a sweep precedes it; see
``time_order.py`` for what is late. Repeated stamps are dropped. All of it is counted in
``Drive.skipped``. Jumps of the odometry are counted and passed on: they happened.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from groma.findings import Finding
from groma.io.drive_choice import TF, Look, choose_odometry, choose_scans, look, mount_for
from groma.io.left_out import left_out
from groma.io.mounting import Mount
from groma.io.recording import Recording
from groma.io.time_order import Sorter
from groma.models import LaserScan, Odometry, Transform

JUMP_M, JUMP_RAD = 0.5, math.radians(45)
FASTEST_M_S, FASTEST_RAD_S = 5.0, 2 * math.pi


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
    skipped: Counter[str] = field(default_factory=Counter)
    """What the last pass left out, by reason."""
    jumps: int = 0
    """Steps of the odometry in the last pass that no robot drives."""
    _edge: tuple[str, str] | None = None

    def events(self) -> Iterator[Odometry | LaserScan]:
        """Yield odometry and scans in order of time; may be called again for another pass."""
        self.skipped.clear()
        self.jumps = 0
        last = {Odometry: -math.inf, LaserScan: -math.inf}
        before: Odometry | None = None
        for event in self._sorted():
            kind = "odometry" if isinstance(event, Odometry) else "scans"
            if event.stamp <= last[type(event)]:
                self.skipped[f"{kind} with the stamp of the one before"] += 1
                continue
            last[type(event)] = event.stamp
            if isinstance(event, Odometry):
                self.jumps += before is not None and is_jump(before, event)
                before = event
            yield event

    def findings(self) -> list[Finding]:
        """Return what was chosen and assumed, and what the last pass left out; the recording has its own besides."""
        return [*self.notes, *left_out(self.skipped), *self._jumps()]

    def _jumps(self) -> Iterator[Finding]:
        if self.jumps:
            times = "once" if self.jumps == 1 else f"{self.jumps} times"
            text = f"the odometry jumps {times}, farther than a robot drives"
            yield Finding("odometry-jump", text, values={"count": (self.jumps, "1")})

    def _sorted(self) -> Iterator[Odometry | LaserScan]:
        sorter: Sorter[Odometry | LaserScan] = Sorter(self.skipped)
        for event in self._chosen():
            if isinstance(event, Odometry):
                yield from sorter.push(event.stamp, 0, event, "odometry")
            else:
                yield from sorter.push(_end(event), 1, event, "scans")
        yield from sorter.drain()

    def _chosen(self) -> Iterator[Odometry | LaserScan]:
        from_tf = self._edge is not None
        names = {self.scans} if self.odometry is None or from_tf else {self.scans, self.odometry}
        if from_tf:
            names |= {stream.name for stream in self.recording.streams if stream.kind == "transform"}
        for message in self.recording.messages(names):
            if isinstance(message, LaserScan):
                if message.stream == self.scans:
                    yield self._upright(message)
            elif isinstance(message, Odometry):
                if message.stream == self.odometry:
                    yield message
            elif from_tf and isinstance(message, Transform) and (message.parent, message.child) == self._edge:
                yield _odometry(message)

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
        When there is no scan stream, or none of the name asked for; the message lists those there are.
    """
    notes: list[Finding] = []
    scan_name = choose_scans(recording, scans, notes)
    odometry_name = choose_odometry(recording, odometry, scan_name, notes)
    found = look(recording, scan_name, odometry_name)
    edge = _tf_odometry(odometry, odometry_name, found, notes)
    base = found.base or (edge[1] if edge else None)
    mount = mount_for(found, base, notes)
    named = f"{TF}:{edge[0]}->{edge[1]}" if edge else odometry_name
    return Drive(recording, scan_name, named, mount or Mount(), mount is not None, notes, _edge=edge)


def _tf_odometry(wanted: str | None, chosen: str | None, found: Look, notes: list[Finding]) -> tuple[str, str] | None:
    if chosen is not None or wanted == "none":
        return None
    edge = found.odometry_edge()
    if edge:
        notes.append(Finding("stream-chosen", f"odometry from the transform {edge[0]} -> {edge[1]}"))
    else:
        notes.append(Finding("odometry-missing", "no odometry in the recording"))
    return edge


def is_jump(before: Odometry, after: Odometry) -> bool:
    """Whether no robot drives from one pose to the next: above 0.5 m and above 5 m/s, or turning likewise."""
    dt = max(after.stamp - before.stamp, 0.0)
    turn = after.theta - before.theta
    turn = abs(math.atan2(math.sin(turn), math.cos(turn)))
    way = math.hypot(after.x - before.x, after.y - before.y)
    return way > max(JUMP_M, FASTEST_M_S * dt) or turn > max(JUMP_RAD, FASTEST_RAD_S * dt)


def _end(scan: LaserScan) -> float:
    """Return the time of the last beam fired."""
    return scan.stamp + max(0.0, (len(scan.ranges) - 1) * scan.geometry.time_increment)


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
    x, y, z, w = edge.quaternion
    theta = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return Odometry(edge.stamp, edge.stream, edge.translation[0], edge.translation[1], theta, edge.parent, edge.child)

"""Which streams of a recording make a drive, and what a bounded look into them tells about frames.

The check reads at most ``LOOK`` messages, and ends as soon as the first scan, the first odometry and the chain of
transforms between their frames have been seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from groma.errors import UserError
from groma.io.recording import Recording
from groma.io.streams import Kind, Stream
from groma.nouns.findings import Finding
from groma.nouns.messages import LaserScan, Odometry, Transform
from groma.recordings.mounting import TILT, Mount, chain, planar

LOOK = 20_000
TF = "tf"
BASES = ("base_link", "base_footprint", "base")
Edge = tuple[str, str]


@dataclass(slots=True)
class Look:
    """What was seen."""

    laser: str | None = None
    """Frame of the first scan."""
    base: str | None = None
    """Child frame of the first odometry."""
    static: dict[Edge, Transform] = field(default_factory=dict)
    moving: dict[Edge, Transform] = field(default_factory=dict)
    """First value of edges published as moving."""
    changed: set[Edge] = field(default_factory=set)
    """Those of them that do move."""

    def take(self, edge: Transform) -> None:
        """Remember a transform."""
        key = (edge.parent, edge.child)
        if edge.static:
            self.static[key] = edge
        elif key not in self.moving:
            self.moving[key] = edge
        elif (edge.translation, edge.quaternion) != (self.moving[key].translation, self.moving[key].quaternion):
            self.changed.add(key)

    def odometry_edge(self) -> Edge | None:
        """Return the edge that can serve as odometry: from a frame called odom."""
        edges = [key for key in self.moving if key[0].split("/")[-1] == "odom"]
        return max(edges, key=lambda key: key in self.changed, default=None)


def choose_scans(recording: Recording, wanted: str | None, notes: list[Finding]) -> str:
    """Return the name of the scan stream."""
    there = [stream for stream in recording.streams if stream.kind is Kind.SCAN]
    if not there:
        raise UserError(
            f"{recording.path}: no laser scans in it ({_listed(recording.streams) or 'nothing groma reads'})"
        )
    if wanted is not None:
        return _named(recording, there, wanted, "scan")
    return _largest(there, "scan streams", "--scans", notes)


def choose_odometry(recording: Recording, wanted: str | None, scans: str, notes: list[Finding]) -> str | None:
    """Return the name of the Odometry stream; None for none, or for the one in /tf."""
    there = [stream for stream in recording.streams if stream.kind is Kind.ODOMETRY]
    if wanted in ("none", TF):
        return None
    if wanted is not None:
        return _named(recording, there, wanted, "odometry")
    if not there:
        return None
    if any(stream.name == scans for stream in there):
        others = ", ".join(stream.name for stream in there if stream.name != scans)
        if others:
            text = f"odometry taken from the {scans} lines themselves; others by --odometry: {others}"
            notes.append(Finding("stream-chosen", text))
        return scans
    return _largest(there, "odometry streams", "--odometry", notes)


def look(recording: Recording, scans: str, odometry: str | None) -> Look:
    """Look into the beginning of a recording for frames and transforms."""
    found = Look()
    transforms = {stream.name for stream in recording.streams if stream.kind is Kind.TRANSFORM}
    names = {scans, *transforms} | ({odometry} if odometry else set())
    for count, message in enumerate(recording.messages(names)):
        if isinstance(message, Transform):
            found.take(message)
        elif isinstance(message, LaserScan) and message.stream == scans:
            found.laser = found.laser or message.frame
        elif isinstance(message, Odometry) and message.stream == odometry:
            found.base = found.base or message.child_frame
        if count >= LOOK or _is_enough(found, odometry, bool(transforms)):
            break
    return found


def _is_enough(found: Look, odometry: str | None, has_tree: bool) -> bool:
    if found.laser is None or (odometry is not None and found.base is None):
        return False
    if not has_tree:
        return True
    if odometry is None and not (found.changed and found.odometry_edge()):
        return False
    return found.base is not None and chain(found.static, found.base, found.laser) is not None


def mount_for(found: Look, base: str | None, notes: list[Finding]) -> Mount | None:
    """Return where the laser sits; None, with a note, when the recording does not say."""
    if found.laser is None:
        return None
    for edges, remark in (
        (found.static, ""),
        ({**found.moving, **found.static}, " (published as moving; first value)"),
    ):
        for frame in dict.fromkeys(name for name in (base, *BASES) if name):
            full = chain(edges, frame, found.laser)
            if full is not None:
                mount = planar(full)
                notes.append(Finding("mount-found", _told(mount, frame, found.laser) + remark))
                if mount.tilt > TILT:
                    notes.append(_tilted(mount))
                return mount
    edge = f"{base or BASES[0]} -> {found.laser or 'laser'}"
    notes.append(Finding("mount-unknown", f"mounting of the laser unknown (no transform {edge}): taken as zero"))
    return None


def _told(mount: Mount, base: str, laser: str) -> str:
    text = f"laser at x {mount.x:.4g} m, y {mount.y:.4g} m, yaw {math.degrees(mount.yaw):.4g} deg ({base} -> {laser})"
    if mount.upside_down:
        text += ", upside down: scans are mirrored"
    return text


def _tilted(mount: Mount) -> Finding:
    text = f"the laser is tilted by {math.degrees(mount.tilt):.3g} deg: its scan plane is not horizontal"
    return Finding("scanner-tilted", text, values={"tilt": (mount.tilt, "rad")})


def _named(recording: Recording, there: list[Stream], wanted: str, what: str) -> str:
    if any(stream.name == wanted for stream in there):
        return wanted
    raise UserError(f"{recording.path}: no {what} stream {wanted!r}; there is: {_listed(tuple(there)) or 'none'}")


def _largest(there: list[Stream], what: str, option: str, notes: list[Finding]) -> str:
    by_count: Callable[[Stream], int] = lambda stream: stream.count or 0  # noqa: E731
    best = max(there, key=by_count)
    if len(there) > 1:
        text = f"{len(there)} {what} ({_listed(tuple(there))}): took {best.name}; choose with {option}"
        notes.append(Finding("stream-chosen", text))
    return best.name


def _listed(streams: tuple[Stream, ...]) -> str:
    return ", ".join(f"{s.name} [{s.kind}{'' if s.count is None else f', {s.count}'}]" for s in streams)

"""What to drive next before each camera, told while a survey runs, until every camera is known as well as wanted.

Of each stop, one image a camera counts: standing still repeats the same errors. A panel in it says where the camera is,
`T_odom_camera = T_odom_base T_base_panel T_camera_panel^-1`, by odometry and intrinsics as far as they are known, which
is good enough to plan by. What all stops told, and what was known before, gives the worst pixel and the next best drive
(docs/theory/planning.md). The floor that may be driven is that of the search, widened to where the robot is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from msgspec.structs import replace

from groma.cameras.calibration import panel_pose
from groma.cameras.survey_messages import to_detection
from groma.errors import UserError
from groma.io import camera_protocol as protocol
from groma.nouns.detection import Detection
from groma.nouns.network import KnownCamera
from groma.nouns.poses import Pose
from groma.nouns.target import Panel, Target
from groma.planning.camera import DEFAULTS, Search, Stage, Stop, plan_camera
from groma.planning.floor import Mount, camera_by_panel, foot_and_mount, from_floor, on_floor


def aim(sigma: float) -> Search:
    """Return the search for a standard deviation of the worst pixel [pixel].

    Raises
    ------
    UserError
        When that is no goal.
    """
    if not (math.isfinite(sigma) and sigma > 0):
        raise UserError(f"sigma {sigma}: must be above 0 and finite")
    return replace(DEFAULTS.search, target=sigma)


@dataclass(frozen=True, slots=True)
class Advice:
    """What is known of a camera, and the next drive before it."""

    camera: str
    worst: float
    """Worst standard deviation of a pixel [pixel]."""
    met: bool
    """Whether that is as good as wanted."""
    expected: float
    """The same after the drive."""
    start: Stop
    """Where the robot stands, on the floor before the camera."""
    looks: tuple[Stop, ...]
    """Where to stop and look on the drive; none when nothing is worth driving."""
    poses: tuple[Pose, ...]
    """The same stops as x, y [m], heading [rad] in the frame of the odometry."""


@dataclass
class Guide:
    """Listen to the messages of a survey, and advise."""

    target: Target
    cameras: Sequence[KnownCamera]
    search: Search = DEFAULTS.search
    seen: dict[str, list[Detection]] = field(default_factory=dict)
    """What counts, by camera."""
    looked: dict[str, list[Pose]] = field(default_factory=dict)
    """Where the robot stood then, in the frame of the odometry."""
    _pose: Pose | None = None
    _stood: dict[tuple[str, int], Pose] = field(default_factory=dict)
    _heard: set[tuple[str, str, int]] = field(default_factory=set)

    def take(self, message: protocol.Numbered) -> Advice | None:
        """Take a new message; return advice when a camera saw the target at a stop that it had not told of."""
        if isinstance(message, protocol.Odometry):
            self._pose = (message.x, message.y, message.theta)
        elif isinstance(message, protocol.Stop) and message.standing and self._pose is not None:
            self._stood.setdefault((message.boot, message.stop), self._pose)
        elif isinstance(message, protocol.Detections):
            return self._look(message)
        return None

    def _look(self, message: protocol.Detections) -> Advice | None:
        known = next((camera for camera in self.cameras if camera.name == message.sender), None)
        stop = (message.survey or "", message.stop)
        pose, told = self._stood.get(stop), (message.sender, *stop)
        if known is None or pose is None or told in self._heard:
            return None
        found = [to_detection(message.sender, message.captured, c) for c in message.panels if self._belongs(c)]
        if not found:
            return None
        self._heard.add(told)
        self.seen.setdefault(known.name, []).extend(found)
        self.looked.setdefault(known.name, []).append(pose)
        return self._advise(known, found, pose)

    def _belongs(self, corners: protocol.Corners) -> bool:
        panel = self._panel(corners.panel)
        return panel is not None and max(corners.ids, default=0) < len(panel.corners)

    def _panel(self, name: str) -> Panel | None:
        return next((panel for panel in self.target.panels if panel.name == name), None)

    def _advise(self, known: KnownCamera, found: Sequence[Detection], pose: Pose) -> Advice | None:
        placed = self._place(known, found, pose)
        if placed is None:
            return None
        foot, mount = placed
        x, y, heading = on_floor(foot, pose)
        near, far = self.search.depth
        search = replace(
            self.search, depth=(min(near, max(x, 0.1)), max(far, x)), side=max(self.search.side, abs(y)), drives=1
        )
        stage = Stage(mount, known.camera, self.target)
        seen = self.seen[known.name]
        start = (max(x, 0.1), y, heading)
        looked = [on_floor(foot, pose) for pose in self.looked[known.name]]
        plan = plan_camera(stage, start, search, covariance=known.covariance, seen=seen, looked=looked)
        met, looks = plan.worst_before <= search.target, plan.stops[1:]
        poses = tuple(from_floor(foot, look.pose) for look in looks)
        return Advice(known.name, plan.worst_before, met, plan.end.worst, plan.stops[0], looks, poses)

    def _place(self, known: KnownCamera, found: Sequence[Detection], pose: Pose) -> tuple[Pose, Mount] | None:
        """Return the foot of a camera in the frame of the odometry, and its mount above it, by the panel seen best."""
        seen = max(found, key=lambda detection: len(detection.corners))
        panel, fit = self.target.panel(seen.panel), panel_pose(known.camera, self.target, seen)
        if fit is None:
            return None
        # None where the camera is below the floor, or looks straight down: a mirrored pose.
        return foot_and_mount(camera_by_panel(pose, (*panel.position, *panel.quaternion), fit.pose))

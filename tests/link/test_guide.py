"""A survey that is led: a camera that is only nominally known, before it a robot that does what it is told."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue

import numpy as np
import pytest
from msgspec.structs import replace

from groma.cameras.calibration import calibrate_camera, projection_sigmas
from groma.cli import run
from groma.errors import UserError
from groma.io.camera_info import write_camera_info
from groma.io.camera_protocol import Corners, Detections, Numbered, Odometry, Stop
from groma.io.panels import write_panels
from groma.link.guide import Advice, Guide, aim
from groma.link.leading import Leader, told
from groma.link.leading import lead as lead_
from groma.nouns.camera import Camera
from groma.nouns.network import KnownCamera
from groma.planning.camera import DEFAULTS, mount
from rigid import planar, spatial

Pose = tuple[float, float, float]
TRUE = Camera(640, 480, "radtan", (624.0, 622.0, 326.0, 231.0, -0.21, 0.06, 0.001, -0.001))
FOOT: Pose = (5.0, -3.0, 2.2)
"""Of the camera, in the frame of the odometry."""


@dataclass
class Robot:
    """A robot with three panels and the camera that looks at it; both err."""

    camera: Camera = TRUE
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))
    true: Pose = (0.0, 0.0, 0.0)
    believed: Pose = (0.0, 0.0, 0.0)
    stops: int = 0
    length: float = 0.0

    def put(self, pose: Pose) -> None:
        self.true = self.believed = pose

    def go(self, to: Pose) -> None:
        """Drive to where odometry says that the pose is; it is off by 1 % of the distance and of the turn."""
        step = np.linalg.inv(planar(self.believed)) @ planar(to)
        way, turn = step[:2, 3], math.atan2(step[1, 0], step[0, 0])
        err = 0.01 * self.random.normal(size=3) * [np.linalg.norm(way), np.linalg.norm(way), abs(turn)]
        moved = planar(self.true) @ planar((way[0] + err[0], way[1] + err[1], turn + err[2]))
        self.true = (moved[0, 3], moved[1, 3], math.atan2(moved[1, 0], moved[0, 0]))
        self.believed, self.length = to, self.length + float(np.linalg.norm(way))

    def stand(self) -> Iterator[Numbered]:
        """Yield what the survey hears at a stop: odometry, the stop, two images with equal content."""
        x, y, theta = self.believed
        self.stops += 1
        yield Odometry(sender="robot", boot="r", sequence=self.stops, stamp=self.stops, x=x, y=y, theta=theta)
        yield Stop(sender="survey", boot="s", sequence=self.stops, stop=self.stops, stamp=self.stops, standing=True)
        panels = tuple(self.seen())
        for frame in range(2):
            yield Detections(
                sender="door", boot="c", sequence=2 * self.stops + frame, frame=frame, survey="s", stop=self.stops,
                captured=self.stops, clock_sigma=0.01, width=640, height=480, panels=panels,
            )  # fmt: skip

    def seen(self) -> Iterator[Corners]:
        position = mount(2.0, 0.43)
        t_odom_camera = planar(FOOT) @ spatial(position[:3], position[3:])
        for panel in DEFAULTS.target.panels:
            pose = np.linalg.inv(t_odom_camera) @ planar(self.true) @ spatial(panel.position, panel.quaternion)
            points = panel.corners @ pose[:3, :3].T + pose[:3, 3]
            facing = -pose[:3, 2] @ points.mean(axis=0) / np.linalg.norm(points.mean(axis=0))
            pixels = self.camera.project(points)
            tags = self.camera.holds(pixels).reshape(-1, 4).all(axis=1)
            if facing < 0.3 or tags.sum() < 4 or (points[:, 2] < 0.1).any():
                continue
            ids = np.flatnonzero(np.repeat(tags, 4))
            u, v = (pixels[ids] + 0.3 * self.random.normal(size=(len(ids), 2))).T.tolist()
            yield Corners(panel=panel.name, ids=tuple(map(int, ids)), u=tuple(u), v=tuple(v), sigma=(0.3,) * len(ids))


def before(distance: float) -> Pose:
    """A place before the camera, facing it."""
    pose = planar(FOOT) @ planar((distance, 0.1, math.pi - 0.2))
    return float(pose[0, 3]), float(pose[1, 3]), math.atan2(pose[1, 0], pose[0, 0])


def guide(sigma: float = 1.0) -> Guide:
    return Guide(DEFAULTS.target, [KnownCamera("door", DEFAULTS.camera)], aim(sigma))


def heard(lead: Guide, robot: Robot) -> Advice | None:
    found = [advice for message in robot.stand() if (advice := lead.take(message)) is not None]
    assert len(found) <= 1, "of two images at a stop, one counts"
    return found[0] if found else None


def test_a_robot_that_does_as_it_is_told_calibrates_the_camera_as_well_as_wanted() -> None:
    lead, robot = guide(1.0), Robot()
    robot.put(before(3.0))
    advice = heard(lead, robot)
    assert advice is not None
    assert "next: " in told(advice)
    while not advice.met:
        assert advice.expected < advice.worst
        for pose in advice.poses:
            robot.go(pose)
            advice = heard(lead, robot) or advice
            if advice.met:
                break
        assert robot.stops < 60
    assert "accurate enough" in told(advice)
    assert robot.length < 6.0
    found = calibrate_camera((640, 480), DEFAULTS.target, lead.seen["door"])
    sigmas = projection_sigmas(found.camera, found.claimed)[1]
    assert np.nanmax(sigmas) < 1.5, "promised from nominal intrinsics, which are 4 % off"
    off = np.array(found.camera.parameters) - np.array(TRUE.parameters)
    distance = off @ np.linalg.solve(found.claimed, off)
    assert distance < 26.1, "chi-square of 8, 0.999"


def test_a_camera_that_is_known_needs_no_drive() -> None:
    covariance = np.diag([1e-4, 1e-4, 1e-4, 1e-4, 1e-10, 1e-10, 1e-10, 1e-10])
    lead = Guide(DEFAULTS.target, [KnownCamera("door", TRUE, covariance)], aim(1.0))
    robot = Robot()
    robot.put(before(3.0))
    advice = heard(lead, robot)
    assert advice is not None
    assert advice.met
    assert advice.poses == ()


def test_the_next_stop_is_told_where_the_robot_thinks_it_is() -> None:
    lead, robot = guide(), Robot()
    robot.put(before(3.0))
    advice = heard(lead, robot)
    assert advice is not None
    first = np.linalg.inv(planar(robot.believed)) @ planar(advice.poses[0])
    moved, turned = float(np.linalg.norm(first[:2, 3])), abs(math.atan2(first[1, 0], first[0, 0]))
    assert moved < 0.26
    assert turned < 0.36
    assert moved + turned > 0.01
    assert math.hypot(advice.start.pose[0] - 3.0, advice.start.pose[1] - 0.1) < 0.4, "by nominal intrinsics"


@pytest.mark.parametrize("what", ["no stop", "unknown camera", "unknown panel", "no such corner", "nothing"])
def test_what_cannot_be_used_is_passed_over(what: str) -> None:
    lead, robot = guide(), Robot()
    robot.put(before(3.0))
    for message in robot.stand():
        if isinstance(message, Stop) and what == "no stop":
            continue
        assert lead.take(spoilt(message, what)) is None
    assert not lead.seen.get("door")


def spoilt(message: Numbered, what: str) -> Numbered:
    if not isinstance(message, Detections):
        return message
    changes: dict[str, Detections] = {
        "unknown camera": replace(message, sender="hall"),
        "unknown panel": replace(message, panels=tuple(replace(p, panel="x") for p in message.panels)),
        "no such corner": replace(message, panels=tuple(replace(p, ids=(*p.ids[1:], 999)) for p in message.panels)),
        "nothing": replace(message, panels=()),
    }
    return changes.get(what, message)


def test_a_goal_that_is_none_is_refused() -> None:
    for sigma in (0.0, -1.0, math.nan):
        with pytest.raises(UserError, match="sigma"):
            aim(sigma)


def test_the_survey_tells_the_driver(capsys: pytest.CaptureFixture[str]) -> None:
    robot, fresh, end = Robot(), SimpleQueue[Numbered](), threading.Event()
    robot.put(before(3.0))
    for message in robot.stand():
        fresh.put(message)
    lead = guide()
    leaders: list[Leader] = [lambda message: told(advice) if (advice := lead.take(message)) else None]
    leading = threading.Thread(target=lead_, args=(leaders, fresh, end))
    leading.start()
    deadline, told_ = time.monotonic() + 30, ""
    while "door: worst-pixel error" not in told_ and time.monotonic() < deadline:
        time.sleep(0.05)
        told_ += capsys.readouterr().err
    end.set()
    leading.join()
    assert "stops (" in told_


def test_a_survey_with_an_impossible_goal_is_refused_before_it_begins(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cameras").mkdir()
    write_panels(tmp_path / "target.toml", DEFAULTS.target)
    write_camera_info(tmp_path / "cameras" / "door.yaml", "door", TRUE)
    assert run(["cameras", "survey", str(tmp_path), "--sigma", "-1", "-o", str(tmp_path / "out")]) == 2
    assert "sigma -1.0: must be above 0" in capsys.readouterr().err

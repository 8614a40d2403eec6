"""Camera and mount from known poses of the robot: recorded data, and what a robot in the plane cannot tell."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from groma.cameras.network import Placed, place_by_poses
from groma.errors import EstimationError
from groma.io.yaml_file import read_yaml
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.network import KnownCamera
from groma.nouns.poses import rotation_matrix
from groma.nouns.target import Charuco, Panel, Target

Array = NDArray[np.float64]

BOARD = Target((Panel("board", Charuco(columns=5, rows=7, square=0.036195, marker=0.018256)),))


class Recorded:
    """A static camera and a robot arm that carries a ChArUco board: 16 poses (see the data's README)."""

    def __init__(self, shared: Path) -> None:
        folder = shared / "data/camera/robot_static_camera_charuco"
        intrinsics = read_yaml(folder / "camera_intr_calibrated.yaml")
        assert isinstance(intrinsics, dict)
        parameters = [intrinsics["intrinsics"][k] for k in ("fx", "fy", "cx", "cy")]
        camera = Camera(1600, 1200, "radtan", (*parameters, 0.0, 0.0, 0.0, 0.0))
        # Published without distortion, although there is some: 1 % of focal length, 20 pixels, 0.1 of k1 and k2.
        sigmas = np.array([13.5, 13.5, 20.0, 20.0, 0.1, 0.1, 0.0, 0.0])
        self.known = KnownCamera("camera", camera, np.diag(sigmas**2))
        poses = [read_yaml(folder / f"poses/{k}.yaml") for k in range(16)]
        self.poses = np.array([[p[k] for k in ("x", "y", "z", "qx", "qy", "qz", "qw")] for p in poses])  # type: ignore[index]
        with (shared / "data/camera/derived_corners/robot_static_camera_charuco.csv").open() as file:
            rows = list(csv.DictReader(file))
        self.seen = [[self._detection([r for r in rows if r["image"] == f"{k}.png"])] for k in range(16)]

    @staticmethod
    def _detection(rows: list[dict[str, str]]) -> Detection:
        ids = np.array([int(row["corner"]) for row in rows], dtype=np.int64)
        pixels = np.array([[float(row["u_px"]), float(row["v_px"])] for row in rows])
        return Detection(0.0, "camera", "board", ids, pixels, np.ones(len(rows)))


@pytest.mark.shared
def test_a_static_camera_and_its_board_on_an_arm_fit_to_1_3_pixels(shared: Path) -> None:
    recorded = Recorded(shared)
    placed = place_by_poses(recorded.known, BOARD, recorded.poses, recorded.seen)
    assert placed.rms <= 1.3
    assert not placed.planar
    assert placed.weak == ()
    # README of the data: its own bundle gave these, at 1.25 px.
    assert placed.camera[:3] == pytest.approx([-0.0196, 1.265, 0.288], abs=0.01)
    assert placed.mount[:3] == pytest.approx([-0.1254, -0.0614, 0.1988], abs=0.01)


@pytest.mark.shared
def test_with_the_motion_made_planar_the_height_is_reported_as_unobservable(shared: Path) -> None:
    recorded = Recorded(shared)
    true = place_by_poses(recorded.known, BOARD, recorded.poses, recorded.seen)
    flat = np.array([_levelled(pose, recorded.poses[0]) for pose in recorded.poses])
    seen = [[_shown(true, pose, group[0])] for pose, group in zip(flat, recorded.seen, strict=True)]
    placed = place_by_poses(recorded.known, BOARD, flat, seen, height=0.3)
    assert placed.planar
    assert len(placed.weak) == 1
    assert "height of the target on the robot is unobservable" in placed.weak[0]
    up = rotation_matrix(flat[0, 3:])[2]
    assert up @ placed.mount[:3] == pytest.approx(0.3, abs=1e-3)
    lift = placed.camera[:3] - true.camera[:3]
    assert np.hypot(*lift[:2]) < 0.01
    assert lift[2] == pytest.approx(up @ (placed.mount[:3] - true.mount[:3]), abs=0.01)
    assert placed.rms < 0.5


def _levelled(pose: Array, first: Array) -> Array:
    """The pose of a robot in the plane that turns as this one does, at one height and tilt: those of the first pose."""
    turn = rotation_matrix(pose[3:]) @ rotation_matrix(first[3:]).T
    yaw = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
    x, y, z, w = first[3:]
    s, c = np.sin(yaw / 2), np.cos(yaw / 2)
    return np.array([pose[0], pose[1], first[2], c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z])


def _shown(placed: Placed, pose: Array, like: Detection) -> Detection:
    """What the camera would see there, with a disturbance of 0.3 pixels."""
    points = BOARD.panels[0].corners[like.corners]
    in_base = points @ rotation_matrix(placed.mount[3:]).T + placed.mount[:3]
    in_world = in_base @ rotation_matrix(pose[3:]).T + pose[:3]
    in_camera = (in_world - placed.camera[:3]) @ rotation_matrix(placed.camera[3:])
    noise = np.random.default_rng(len(points)).normal(size=(len(points), 2))
    pixels = placed.intrinsics.project(in_camera) + 0.3 * noise
    return Detection(0.0, "camera", "board", like.corners, pixels, np.ones(len(points)))


def test_two_views_are_too_few() -> None:
    camera = KnownCamera("camera", Camera(640, 480, "pinhole", (600.0, 600.0, 319.5, 239.5)))
    with pytest.raises(EstimationError, match="three views"):
        place_by_poses(camera, BOARD, np.tile([0, 0, 0, 0, 0, 0, 1.0], (2, 1)), [[], []])

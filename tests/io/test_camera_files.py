"""Targets and intrinsics as files: ours, Kalibr's, ROS's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.camera_info import read_camera_info, write_camera_info
from groma.io.kalibr_camchain import read_camchain, write_camchain
from groma.io.panels import write_panels
from groma.io.target_file import read_target
from groma.nouns.camera import LENSES, Camera
from groma.nouns.poses import quaternion_of_rpy, rpy_of
from groma.nouns.target import Charuco, Chessboard, Panel, TagGrid, Target

KALIBR_GRID = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.088 # m\ntagSpacing: 0.3\n"
KALIBR_BOARD = (
    "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n"
)


def _file(directory: Path, name: str, text: str) -> Path:
    path = directory / name
    path.write_text(text)
    return path


def _camera(lens: str) -> Camera:
    return Camera(640, 480, lens, (600.5, 601.25, 320.0, 240.125, *(0.01 * k for k in range(len(LENSES[lens]) - 4))))


def test_targets_of_kalibr_are_read(tmp_path: Path) -> None:
    grid = read_target(_file(tmp_path, "a.yaml", KALIBR_GRID)).panels[0].pattern
    assert grid == TagGrid(columns=6, rows=5, size=0.088, spacing=0.3, border=2)
    board = read_target(_file(tmp_path, "b.yaml", KALIBR_BOARD)).panels[0].pattern
    assert board == Chessboard(columns=6, rows=7, square=0.06)


def test_panels_read_back_as_they_were(tmp_path: Path) -> None:
    turn = quaternion_of_rpy(0.1, -0.2, 2.5)
    target = Target(
        (
            Panel("front", TagGrid(columns=6, rows=6, size=0.08), (0.3, -0.1, 0.6), turn),
            Panel("left", TagGrid(columns=6, rows=6, size=0.08, first_id=36)),
            Panel("back", Charuco(columns=5, rows=7, square=0.04, marker=0.03)),
        )
    )
    write_panels(tmp_path / "panels.toml", target)
    again = read_target(tmp_path / "panels.toml")
    assert [panel.pattern for panel in again.panels] == [panel.pattern for panel in target.panels]
    assert again.panels[0].quaternion == pytest.approx(turn, abs=1e-15)
    assert rpy_of(again.panels[0].quaternion) == pytest.approx((0.1, -0.2, 2.5), abs=1e-15)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.yaml", "target_type: circlegrid\n", "must be aprilgrid or checkerboard"),
        ("a.yaml", KALIBR_GRID.replace("tagSize", "size"), "missing required field `tagSize`"),
        ("a.yaml", KALIBR_GRID.replace("0.088", "-1"), "size = -1"),
        ("a.yaml", KALIBR_BOARD.replace("colSpacingMeters: 0.06", "colSpacingMeters: 0.07"), "squares must be square"),
        ("a.yaml", "a: [", "not a yaml file"),
        ("a.toml", "panel = 3\n", "a target has tables [[panel]] and nothing else"),
        ("a.toml", "[[panel]]\nname = 'a'\ntype = 'aprilgrid'\ncolums = 3\n", "panel[0]: "),
        ("a.toml", "[[panel]\n", "is not TOML"),
        ("a.txt", "", "a target is a .toml"),
    ],
)
def test_a_bad_target_is_refused_in_one_line(tmp_path: Path, name: str, text: str, message: str) -> None:
    with pytest.raises(UserError) as refusal:
        read_target(_file(tmp_path, name, text))
    assert str(tmp_path / name) in str(refusal.value)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("lens", LENSES)
def test_camera_info_reads_back_as_the_same_camera(tmp_path: Path, lens: str) -> None:
    camera = _camera(lens)
    write_camera_info(tmp_path / "info.yaml", "door: 3", camera)
    name, again = read_camera_info(tmp_path / "info.yaml")
    points = np.array([[0.4, 0.3, 1.0], [-0.2, 0.1, 1.0]])
    assert name == "door: 3"
    assert again.project(points) == pytest.approx(camera.project(points), abs=1e-12)


@pytest.mark.parametrize("lens", ["pinhole", "radtan", "equidistant"])
def test_a_camchain_reads_back_as_the_same_cameras(tmp_path: Path, lens: str) -> None:
    cameras = {"/door/image": _camera(lens), "/hall/image": _camera("radtan")}
    write_camchain(tmp_path / "chain.yaml", cameras, {"/hall/image": np.eye(4)})
    assert read_camchain(tmp_path / "chain.yaml") == cameras


def test_cameras_that_a_format_cannot_hold_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="Kalibr has no lens rational"):
        write_camchain(tmp_path / "chain.yaml", {"a": _camera("rational")})
    omni = "cam0:\n  camera_model: omni\n  intrinsics: [1, 2]\n  distortion_model: radtan\n  resolution: [6, 4]\n"
    with pytest.raises(UserError, match="cam0 is omni-radtan"):
        read_camchain(_file(tmp_path, "omni.yaml", omni))
    write_camera_info(tmp_path / "info.yaml", "a", _camera("plumb_bob"))
    text = (tmp_path / "info.yaml").read_text()
    with pytest.raises(UserError, match="distortion_model 'scaramuzza'"):
        read_camera_info(_file(tmp_path, "other.yaml", text.replace("plumb_bob", "scaramuzza")))
    with pytest.raises(UserError, match="no skew"):
        read_camera_info(_file(tmp_path, "skew.yaml", text.replace("[600.5, 0.0,", "[600.5, 0.1,")))

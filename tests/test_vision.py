"""Panels in images: rendered ones, OpenCV's own boards, and real frames of others."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from camera_scenes import CAMERA, TARGET, poses
from groma.cameras.calibration import panel_pose
from groma.cameras.vision import detect, detect_tags, drawings
from groma.errors import UserError
from groma.io.images import read_images
from groma.io.notes import Notes
from groma.nouns.target import Charuco, Chessboard, Panel, TagGrid, Target
from groma.simulation.rendering import appearance, render

KALIBR_FRAMES = {
    "EuRoC": (36, 6),
    "TUM_VI": (36, 6),
    "right": (36, 6),
    "r45": (36, 6),
    "iphone": (66, 36),
    "two_boards": (72, 36),
}
"""Tags in each frame, and how many tags a row of the target must have to hold all of their numbers."""


def test_a_rendered_panel_is_found_where_it_is() -> None:
    pose = poses(1, seed=2)[0]
    detections, left_out = detect(render(CAMERA, TARGET, [pose]), TARGET, camera="door", stamp=3.0)
    (seen,) = detections
    corners = TARGET.panels[0].corners[seen.corners] @ pose[:3, :3].T + pose[:3, 3]
    assert (seen.camera, seen.panel, seen.stamp) == ("door", "panel", 3.0)
    assert len(seen.corners) >= 130
    assert sum(left_out.values()) <= 4
    assert np.sqrt(np.mean((seen.pixels - CAMERA.project(corners)) ** 2)) < 0.08
    found = panel_pose(CAMERA, TARGET, seen)
    assert found is not None
    assert found.decided
    assert found.pose == pytest.approx(pose, abs=2e-3)
    assert found.sensitivity.shape == (6, 8)


def test_one_image_holds_several_panels() -> None:
    two = Target(
        (
            Panel("low", TagGrid(columns=3, rows=3, size=0.08)),
            Panel("high", TagGrid(columns=3, rows=3, size=0.08, first_id=9)),
        )
    )
    left, right = np.eye(4), np.eye(4)
    left[:3, :3] = right[:3, :3] = np.diag([1.0, -1.0, -1.0])
    left[:3, 3], right[:3, 3] = (-0.4, 0.15, 1.2), (0.1, 0.15, 1.2)
    seen, _ = detect(render(CAMERA, two, [left, right]), two)
    assert [(d.panel, len(d.corners)) for d in seen] == [("low", 36), ("high", 36)]


def test_boards_of_opencv_are_found() -> None:
    board = Charuco(columns=5, rows=7, square=0.04, marker=0.024)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250)
    drawn = cv2.aruco.CharucoBoard((5, 7), 0.04, 0.024, dictionary).generateImage((500, 700), marginSize=50)
    (seen,), _ = detect(np.asarray(drawn), Target((Panel("board", board),)))
    # 80 pixels a square: the first inner corner lies between pixels, half a pixel before 50 + 80.
    assert seen.corners.tolist() == list(range(24))
    assert seen.pixels[0] == pytest.approx([129.5, 149.5], abs=0.6)
    assert np.ptp(seen.pixels[:4, 1]) < 0.1
    assert seen.pixels[1] - seen.pixels[0] == pytest.approx([80.0, 0.0], abs=0.1)


def test_a_rendered_chessboard_is_found() -> None:
    target = Target((Panel("board", Chessboard(columns=7, rows=5, square=0.05)),))
    pose = np.eye(4)
    pose[:3, 3] = (-0.15, -0.1, 0.8)
    (seen,), _ = detect(render(CAMERA, target, [pose]), target)
    truth = CAMERA.project(target.panels[0].corners + pose[:3, 3])
    off = np.minimum(np.abs(seen.pixels - truth).max(), np.abs(seen.pixels[::-1] - truth).max())
    assert off < 0.15
    assert (seen.sigma < 0.1).all()


def test_what_there_is_not_is_not_found() -> None:
    empty = np.full((240, 320), 128, dtype=np.uint8)
    assert detect(empty, TARGET)[0] == []
    boards = Target((Panel("a", Chessboard(7, 5, 0.05)), Panel("b", Charuco(5, 7, 0.04, 0.024))))
    assert detect(empty, boards)[0] == []


def test_what_cannot_be_looked_for_is_refused() -> None:
    image = np.zeros((100, 100), dtype=np.uint8)
    with pytest.raises(UserError, match='no family of tags is called "tag37"'):
        detect(image, Target((Panel("a", TagGrid(2, 2, 0.1, family="tag37")),)))
    with pytest.raises(UserError, match="no dictionary is called 'DICT_9'"):
        detect(image, Target((Panel("a", Charuco(5, 7, 0.04, 0.02, dictionary="DICT_9")),)))
    with pytest.raises(UserError, match="unknown field `sharp`"):
        detect(image, TARGET, gates={"sharp": 1})


def test_a_tag_is_drawn_as_it_is_read() -> None:
    tag = drawings(TagGrid(columns=1, rows=1, size=0.1, first_id=17, border=1))[0]
    image = np.pad(np.kron(tag, np.ones((12, 12), dtype=np.uint8)) * 255, 40, constant_values=255)
    (found,) = detect_tags(image.astype(np.uint8))
    assert found.id == 17
    assert found.corners == pytest.approx(
        np.array([[39.5, 135.5], [135.5, 135.5], [135.5, 39.5], [39.5, 39.5]]), abs=0.3
    )


@pytest.mark.shared
@pytest.mark.parametrize("name", KALIBR_FRAMES)
def test_all_tags_of_kalibr_grids_are_found(shared: Path, name: str) -> None:
    count, columns = KALIBR_FRAMES[name]
    (image,) = read_images(shared / "data/camera/kalibr_aprilgrid_frames" / f"{name}.png", Notes())
    target = Target((Panel("grid", TagGrid(columns, 6 if columns == 6 else 12, 0.088)),))
    (seen,), _ = detect(image.pixels, target)
    assert len(np.unique(seen.corners // 4)) == count


@pytest.mark.shared
def test_the_reference_detector_is_agreed_with(shared: Path) -> None:
    matched, total, off = 0, 0, []
    for path in sorted((shared / "data/camera/apriltag_reference_corners").glob("*.jpg")):
        (image,) = read_images(path, Notes())
        found = detect_tags(image.pixels)
        for line in path.with_suffix(".txt").read_text().splitlines():
            if not line.strip():
                continue
            number, *numbers = line.replace("(", " ").replace(")", " ").replace(",", " ").split()
            reference = np.array(numbers[:8], dtype=float).reshape(4, 2) - 0.5
            near = [np.abs(tag.corners - reference).max() for tag in found if tag.id == int(number)]
            total += 1
            if near and min(near) < 3:
                matched += 1
                off.append(min(near))
    assert total == 47
    assert matched >= 45
    assert np.median(off) < 0.5


def test_noise_and_blur_are_as_required() -> None:
    flat = render(CAMERA, TARGET, [], appearance(noise=3.0, blur=0.0)).astype(float)
    smooth = render(CAMERA, TARGET, [], appearance(noise=0.0, blur=0.0)).astype(float)
    assert np.std(flat - smooth) == pytest.approx(3.0, abs=0.1)
    with pytest.raises(ValueError, match="blur"):
        render(CAMERA, TARGET, [], appearance(blur=-1.0))

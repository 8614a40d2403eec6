"""Cameras and targets in numpy terms."""

from __future__ import annotations

import numpy as np
import pytest

from groma.nouns.camera import LENSES, Camera
from groma.nouns.target import Charuco, Chessboard, Panel, TagGrid, Target


def test_a_camera_projects_and_looks_back() -> None:
    camera = Camera(640, 480, "radtan", (600.0, 610.0, 319.5, 239.5, -0.2, 0.0, 0.001, 0.0))
    points = np.array([[0.3, -0.2, 2.0], [0.0, 0.0, -1.0], [9.0, 0.0, 1.0]])
    pixels = camera.project(points)
    assert np.isfinite(pixels[0]).all()
    assert np.isnan(pixels[1:]).all()
    rays = camera.unproject(pixels[:1])
    assert rays * np.linalg.norm(points[0]) == pytest.approx(points[:1], abs=1e-12)
    assert camera.holds(np.array([[-0.5, 479.5], [-0.6, 0.0]])).tolist() == [True, False]
    assert camera.matrix[0].tolist() == [600.0, 0.0, 319.5]


def test_a_senseless_camera_is_refused() -> None:
    with pytest.raises(ValueError, match="no lens is called 'radial'"):
        Camera(640, 480, "radial", (1.0,))
    with pytest.raises(ValueError, match="a radtan camera has 8 parameters"):
        Camera(640, 480, "radtan", (600.0, 600.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="fx = -600"):
        Camera(640, 480, "pinhole", (-600.0, 600.0, 0.0, 0.0))
    assert LENSES["equidistant"] == ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")


def test_panels_have_corners_in_the_order_of_their_numbers() -> None:
    grid = Panel("grid", TagGrid(columns=2, rows=2, size=0.1, spacing=0.5))
    assert grid.corners.shape == (16, 3)
    assert grid.corners[14] == pytest.approx([0.25, 0.25, 0.0])
    board = Panel("board", Chessboard(columns=9, rows=6, square=0.025))
    assert board.corners[-1] == pytest.approx([0.2, 0.125, 0.0])
    charuco = Panel("charuco", Charuco(columns=5, rows=7, square=0.04, marker=0.02))
    assert charuco.corners[0] == pytest.approx([0.04, 0.04, 0.0])


def test_a_target_whose_panels_look_alike_is_refused() -> None:
    grid = TagGrid(columns=2, rows=2, size=0.1)
    target = Target((Panel("a", grid), Panel("b", TagGrid(columns=2, rows=2, size=0.1, first_id=4))))
    assert target.panel("b").pattern.first_id == 4  # type: ignore[union-attr]
    with pytest.raises(KeyError):
        target.panel("c")
    with pytest.raises(ValueError, match='panels "a" and "b" share tags or name'):
        Target((Panel("a", grid), Panel("b", grid)))
    with pytest.raises(ValueError, match="no panel"):
        Target(())
    with pytest.raises(ValueError, match="size = 0"):
        Target((Panel("a", TagGrid(columns=2, rows=2, size=0.0)),))

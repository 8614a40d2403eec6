from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groma.nouns.messages import Transform
from groma.recordings.mounting import chain, matrix, planar

Q = tuple[float, float, float, float]


def edge(parent: str, child: str, xyz: tuple[float, float, float], q: Q = (0, 0, 0, 1)) -> Transform:
    return Transform(0.0, "/tf_static", parent, child, xyz, q, static=True)


def tree(*edges: Transform) -> dict[tuple[str, str], Transform]:
    return {(e.parent, e.child): e for e in edges}


def about_z(angle: float) -> Q:
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


def test_a_chain_through_frames_and_against_an_edge() -> None:
    edges = tree(
        edge("base_footprint", "base_link", (0, 0, 0.1)),
        edge("base_link", "tower", (0.2, 0, 0.3), about_z(math.pi / 2)),
        edge("laser", "tower", (-0.1, 0, 0)),
        edge("elsewhere", "far", (9, 9, 9)),
    )
    full = chain(edges, "base_footprint", "laser")
    assert full is not None
    mount = planar(full)
    assert (mount.x, mount.y, mount.yaw) == pytest.approx((0.2, 0.1, math.pi / 2))
    assert chain(edges, "base_footprint", "far") is None


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_a_quaternion_of_any_length_is_a_rotation(q: Q) -> None:
    rotation = matrix(edge("a", "b", (0, 0, 0), q))[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_a_quarter_turn_takes_x_to_y() -> None:
    np.testing.assert_allclose(matrix(edge("a", "b", (0, 0, 0), about_z(math.pi / 2)))[:3, 0], [0, 1, 0], atol=1e-15)


def test_a_quaternion_of_zeros_is_no_rotation() -> None:
    np.testing.assert_array_equal(matrix(edge("a", "b", (1, 2, 3), (0, 0, 0, 0)))[:3, :3], np.eye(3))


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0])
def test_upside_down(yaw: float) -> None:
    mount = planar(
        matrix(edge("a", "b", (0.1, 0.2, 0.3), about_z(yaw))) @ matrix(edge("b", "c", (0, 0, 0), (1, 0, 0, 0)))
    )
    assert mount.upside_down
    assert (mount.x, mount.y, mount.yaw, mount.tilt) == pytest.approx((0.1, 0.2, yaw, 0.0))


def test_tilt() -> None:
    half = math.radians(10) / 2
    assert planar(matrix(edge("a", "b", (0, 0, 0), (0, math.sin(half), 0, math.cos(half))))).tilt == pytest.approx(
        math.radians(10)
    )

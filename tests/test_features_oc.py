"""The detector of orthogonal corners in the numpy API."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groma.features import corners as features
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry

STEP = np.pi / 360


def geometry(angle_min: float = 0.0) -> BeamGeometry:
    """A scanner that looks all round."""
    return BeamGeometry(angle_min=angle_min, angle_increment=STEP, time_increment=0, range_min=0.1, range_max=20)


def room(turn: float = 0.0) -> Array:
    """Ranges to the walls of a room, 4 m ahead, 3 m behind, 3 m left, 2 m right, turned."""
    bearings = STEP * np.arange(720) - turn
    x, y = np.cos(bearings), np.sin(bearings)
    with np.errstate(divide="ignore", over="ignore"):
        ranges: Array = np.minimum(np.where(x > 0, 4, -3) / x, np.where(y > 0, 3, -2) / y)
    return ranges


@given(turn=st.floats(-4, 4), angle=st.floats(-10, 10))
def test_finds_the_corners_however_turned(turn: float, angle: float) -> None:
    found = features.oc(room(turn), geometry(angle))
    corners = np.array([[4, 3], [-3, 3], [-3, -2], [4, -2]])
    c, s = np.cos(turn + angle), np.sin(turn + angle)
    expected = corners @ np.array([[c, s], [-s, c]])
    distance = np.linalg.norm(found.point[:, None] - expected, axis=2)
    assert distance.shape == (4, 4)
    assert distance.min(axis=0).max() < 0.03
    inward = np.arctan2(*-np.sign(corners[distance.argmin(axis=1)]).T[::-1]) + turn + angle
    assert np.abs(np.exp(1j * found.orientation) - np.exp(1j * inward)).max() < 0.02
    assert np.linalg.eigvalsh(found.covariance).min() > 0


def test_batch_equals_one_by_one_and_degenerate_scans_have_none() -> None:
    scans = [room(), np.full(720, np.nan), np.full(720, 3.0), room(1.0)[:500], np.empty(0)]
    found = features.oc_batch(scans, geometry())
    assert [len(k) for k in found[:3]] == [4, 0, 0]
    assert len(found[4]) == 0
    for scan, keypoints in zip(scans, found, strict=True):
        np.testing.assert_array_equal(features.oc(scan, geometry()).point, keypoints.point)


def test_options_have_names_and_ranges() -> None:
    assert len(features.oc(room(), geometry(), suppression_radius=20)) == 1
    with pytest.raises(ValueError, match="unknown field `beta`, expected one of `a`, `b`"):
        features.oc(room(), geometry(), beta=2.5)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="tolerance = 0: it must be above 0 m"):
        features.oc(room(), geometry(), tolerance=0)
    with pytest.raises(ValueError, match=r"a scan has shape \(1, 720\): it must have one dimension"):
        features.oc(room()[None], geometry())

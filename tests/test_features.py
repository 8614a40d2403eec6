"""The numpy API of the features: shapes, errors, and that it says what the core says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groma.features import corners as features
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry

GEOMETRY = BeamGeometry(
    angle_min=-np.pi / 2, angle_increment=np.pi / 360, time_increment=0, range_min=0.1, range_max=20
)
BEARINGS = GEOMETRY.angle_min + GEOMETRY.angle_increment * np.arange(361)


def room() -> Array:
    """Ranges to the walls of a room, 4 m ahead, 3 m left, 2 m right, with a box in front of the wall ahead."""
    x, y = np.cos(BEARINGS), np.sin(BEARINGS)
    with np.errstate(divide="ignore"):
        walls = np.minimum(4 / np.maximum(x, 0), np.where(y > 0, 3 / y, -2 / y))
        box = np.where(np.abs(3 * y / x) < 0.5, 3 / x, np.inf)
    ranges: Array = np.minimum(walls, box)
    return ranges


def moved(points: Array, x: float, y: float, theta: float) -> Array:
    """Points after a rigid motion."""
    c, s = np.cos(theta), np.sin(theta)
    result: Array = points @ np.array([[c, s], [-s, c]]) + [x, y]
    return result


def test_finds_the_corners_of_a_room() -> None:
    keypoints = features.falko(room(), GEOMETRY)
    for corner, opening in (((4, 3), -3 * np.pi / 4), ((4, -2), 3 * np.pi / 4)):
        distance = np.linalg.norm(keypoints.point - corner, axis=1)
        nearest = int(distance.argmin())
        assert distance[nearest] < 0.03
        assert abs(keypoints.orientation[nearest] - opening) < 0.2
        sigma = np.sqrt(np.linalg.eigvalsh(keypoints.covariance[nearest]))
        assert np.all((sigma > 1e-4) & (sigma < 0.05))
    assert keypoints.covariance.shape == (len(keypoints), 2, 2)


def test_batch_equals_one_by_one_whatever_the_container() -> None:
    scans = [room(), np.full(361, np.nan), 1.1 * room(), room()[:300]]
    each = [features.falko(scan, GEOMETRY) for scan in scans]
    for found in (features.falko_batch(scans, GEOMETRY), features.falko_batch(np.array(scans[:3]), GEOMETRY)):
        for one, other in zip(each, found, strict=False):
            np.testing.assert_array_equal(one.point, other.point)
            np.testing.assert_array_equal(one.covariance, other.covariance)
    assert [len(k) > 0 for k in each] == [True, False, True, True]
    assert features.falko_batch([], GEOMETRY) == []


def test_options_have_names_and_ranges() -> None:
    falko, glarot, association = features.defaults()
    assert (falko["a"], falko["b"], falko["sectors"]) == (0.2, 0.07, 16)
    assert glarot["n_theta"] > 1
    assert association["min_pairs"] >= 2
    assert len(features.falko(room(), GEOMETRY, a=0.2)) == len(features.falko(room(), GEOMETRY))
    with pytest.raises(ValueError, match="unknown field `radius`, expected one of `a`, `b`"):
        features.falko(room(), GEOMETRY, radius=1.0)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="sectors = 15: it must be even, 2 to 360"):
        features.falko(room(), GEOMETRY, sectors=15)
    with pytest.raises(ValueError, match="rho_max = -1: it must be above 0 m"):
        features.Signature([[0, 0]], rho_max=-1)
    with pytest.raises(ValueError, match="min_pairs = 1: it must be 2 or more"):
        features.associate([[0, 0]], [[0, 0]], min_pairs=1)


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(ValueError, match=r"a scan has shape \(1, 361\): it must have one dimension"):
        features.falko(room()[None], GEOMETRY)
    with pytest.raises(ValueError, match=r"points has shape \(3,\): it must be \(N, 2\) and finite"):
        features.Signature([1, 2, 3])
    with pytest.raises(ValueError, match=r"compatible has shape \(2, 2\): it must be \(1, 2\)"):
        features.associate([[0, 0]], [[0, 0], [1, 1]], np.ones((2, 2)))
    with pytest.raises(ValueError, match="a has 1 points and b 2"):
        features.rigid_fit([[0, 0]], [[0, 0], [1, 1]])


@given(angle=st.floats(-10, 10))
def test_descriptors_turn_with_the_scan(angle: float) -> None:
    turned = BeamGeometry(GEOMETRY.angle_min + angle, GEOMETRY.angle_increment, 0, 0.1, 20)
    before, after = features.falko(room(), GEOMETRY), features.falko(room(), turned)
    cells = features.bsc_distance(features.bsc(room(), GEOMETRY, before, 0.5), features.bsc(room(), turned, after, 0.5))
    shares = features.cgh_distance(
        features.cgh(room(), GEOMETRY, before, 0.5), features.cgh(room(), turned, after, 0.5)
    )
    assert np.diag(cells).max() == 0
    assert cells.max() > 10
    assert np.diag(shares).max() < 1e-6
    assert shares.max() > 0.3


def test_descriptor_distances() -> None:
    a = np.array([[0] * 16, [1] + [0] * 15, [255] * 16], dtype=np.uint8)
    np.testing.assert_array_equal(features.bsc_distance(a, a[1:]), [[1, 128], [0, 127], [127, 0]])
    h = np.zeros((3, 16), dtype=np.float32)
    h[0, 3], h[1, 4], h[1, 3] = 1, 0.5, 0.5
    expected = np.array([[0, 1 / 3, 1], [1 / 3, 0, 1], [1, 1, 1]])
    np.testing.assert_allclose(features.cgh_distance(h, h), expected, atol=1e-7)


def test_signatures_find_the_place_and_its_turn() -> None:
    rng = np.random.default_rng(5)
    places = [rng.uniform(0, 15, (25, 2)) for _ in range(40)]
    index = features.SignatureIndex()
    for place in places:
        index.add(features.Signature(place))
    seen = moved(places[17] + rng.normal(0, 0.05, (25, 2)), 3, -8, 0.6)[rng.permutation(25)[:20]]
    found = index.query(features.Signature(seen), 3)
    assert len(index) == 40
    assert found[0][0] == 17
    assert abs(found[0][2] - (np.pi - 0.6)) < 0.1
    assert [f[1] for f in found] == sorted(f[1] for f in found)
    allowed = np.arange(40) != 17
    assert found[1] == index.query(features.Signature(seen), 3, allowed)[0]


def test_a_signature_can_be_compared_without_a_turn() -> None:
    corridor = np.column_stack([np.arange(8.0), np.zeros(8)])
    along, across = features.Signature(corridor), features.Signature(corridor[:, ::-1])
    assert along.distance(across)[0] < 0.02
    assert along.distance_unturned(across) > 0.95
    assert along.distance_unturned(features.Signature(corridor + np.array([30, -5]))) < 0.02


def test_association_recovers_the_motion() -> None:
    rng = np.random.default_rng(8)
    truth = (4.0, -2.0, 2.2)
    b = rng.uniform(0, 20, (30, 2))
    a = np.concatenate([rng.uniform(0, 20, (15, 2)), moved(b[:20], *truth) + rng.normal(0, 0.02, (20, 2))])
    best = features.associate(a, b)[0]
    np.testing.assert_allclose(best.transform, truth, atol=0.05)
    np.testing.assert_array_equal(best.pairs[:, 0] - 15, best.pairs[:, 1])
    fit = features.rigid_fit(a[best.pairs[:, 0]], b[best.pairs[:, 1]], np.sqrt(2) * 0.03)
    assert fit is not None
    np.testing.assert_allclose(fit.transform, best.transform, rtol=1e-12)
    np.testing.assert_allclose(fit.covariance, best.covariance, rtol=1e-12)
    assert features.rigid_fit([[0, 0]], [[0, 0]]) is None
    assert features.associate([], b) == []

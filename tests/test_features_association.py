"""The ways to associate two sets of landmarks, in the numpy API."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from groma.features import association
from groma.features import corners as features
from groma.nouns.arrays import Array

TRUTH = (4.0, -2.0, 2.2)
METHODS = get_args(association.Method)


def moved(points: Array) -> Array:
    """Points after the true motion."""
    x, y, theta = TRUTH
    c, s = np.cos(theta), np.sin(theta)
    result: Array = points @ np.array([[c, s], [-s, c]]) + [x, y]
    return result


def maps() -> tuple[Array, Array]:
    """15 landmarks in common, 10 more in each map; number i of b is number i + 10 of a."""
    rng = np.random.default_rng(8)
    b = rng.uniform(0, 20, (25, 2))
    seen = moved(b[:15]) + rng.normal(0, 0.02, (15, 2))
    return np.concatenate([rng.uniform(-20, 20, (10, 2)), seen]), b


def guess(method: association.Method) -> tuple[float, float, float] | None:
    """A prior near the truth, where one is needed."""
    return (4.03, -2.02, 2.203) if method == "nearest" else None


@pytest.mark.parametrize("method", METHODS)
def test_every_method_recovers_the_motion(method: association.Method) -> None:
    a, b = maps()
    best, *_ = features.associate(a, b, method=method, prior=guess(method), draws=20_000)
    np.testing.assert_allclose(best.transform, TRUTH, atol=0.05)
    np.testing.assert_array_equal(best.pairs[:, 0] - 10, best.pairs[:, 1])
    assert len(best.pairs) == 15
    assert best.complete
    assert np.linalg.eigvalsh(best.covariance).min() > 0


@pytest.mark.parametrize("method", METHODS)
def test_no_method_pairs_a_mirror_image(method: association.Method) -> None:
    a, _ = maps()
    found = features.associate(a, a * [-1, 1], method=method, prior=guess(method))
    assert all(len(motion.pairs) < 10 for motion in found)


def test_caps_and_seeds() -> None:
    a, b = maps()
    cut = features.associate(a, b, method="clique", max_steps=3000)
    assert not any(motion.complete for motion in cut)
    one, same = (features.associate(a, b, method="ransac", seed=3, draws=500) for _ in range(2))
    assert [m.transform.tolist() for m in one] == [m.transform.tolist() for m in same]


def test_what_is_asked_wrongly_is_named() -> None:
    with pytest.raises(ValueError, match="unknown variant `icp`, expected one of `exhaustive`, `nearest`"):
        features.associate([[0, 0]], [[0, 0]], method="icp")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="method 'nearest' needs a prior"):
        features.associate([[0, 0]], [[0, 0]], method="nearest")
    with pytest.raises(ValueError, match="method 'hough' takes no prior"):
        features.associate([[0, 0]], [[0, 0]], method="hough", prior=[0, 0, 0])
    with pytest.raises(ValueError, match=r"prior has shape \(2,\): it must be \(3,\) and finite"):
        features.associate([[0, 0]], [[0, 0]], method="nearest", prior=[0, 0])

"""The values that calibration takes and gives."""

from __future__ import annotations

import numpy as np

from groma.calibration import SensorMotions


def test_motions_of_poses_carry_the_scatter_of_their_draws() -> None:
    poses = np.array([[0.0, 0.0, 0.3], [1.0, 0.4, 1.5], [0.2, 1.9, 3.9], [0.1, 0.2, 5.0]])
    sigmas = np.diag([2e-4, 3e-4, 1e-4])
    covariances = np.tile(sigmas**2, (4, 1, 1))
    exact = SensorMotions.from_poses(np.arange(4.0), poses, covariances)
    rng = np.random.default_rng(1)
    draws = []
    for _ in range(20_000):
        xi = rng.normal(size=(4, 3)) @ sigmas
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        moved = np.column_stack([cos * xi[:, 0] - sin * xi[:, 1], sin * xi[:, 0] + cos * xi[:, 1], xi[:, 2]])
        motion = SensorMotions.from_poses(np.arange(4.0), poses + moved, covariances).motion
        draws.append(_in_frame_of_end(motion - exact.motion, exact.motion).ravel())
    scatter = np.cov(np.array(draws).T)
    assert exact.covariance is not None
    assert exact.coupling is not None
    floor = 4e-9
    for k in range(3):
        block = scatter[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        np.testing.assert_allclose(block, exact.covariance[k], atol=floor, rtol=0.05)
    for k in range(2):
        block = scatter[3 * k : 3 * k + 3, 3 * k + 3 : 3 * k + 6]
        np.testing.assert_allclose(block, exact.coupling[k], atol=floor, rtol=0.05)


def test_motions_of_poses_keep_whole_turns() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 4.0], [0.0, 0.0, 8.5]])
    motions = SensorMotions.from_poses(np.arange(3.0), poses, np.zeros((3, 3, 3)))
    np.testing.assert_allclose(motions.motion[:, 2], [4.0, 4.5])


def _in_frame_of_end(error: np.ndarray, motion: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(motion[:, 2]), np.sin(motion[:, 2])
    x, y = error[:, 0], error[:, 1]
    return np.column_stack([cos * x + sin * y, cos * y - sin * x, error[:, 2]])

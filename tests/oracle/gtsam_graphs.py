"""Pose graphs in GTSAM."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from pose_graphs import Array, Graph, compose, inverse


def between_factors(graph: Graph) -> Any:
    """GTSAM's own factors; their error is the logarithm in SE(2), not g2o's vector."""
    factors = _anchored(graph)
    for pair, z, information in zip(*graph.edges, strict=True):
        noise = gtsam.noiseModel.Gaussian.Information(information)
        factors.add(gtsam.BetweenFactorPose2(int(pair[0]), int(pair[1]), gtsam.Pose2(*z), noise))
    return factors


def g2o_factors(graph: Graph) -> Any:
    """Factors whose error is g2o's, with Jacobians by central differences."""
    factors = _anchored(graph)
    for pair, z, information in zip(*graph.edges, strict=True):
        noise = gtsam.noiseModel.Gaussian.Information(information)
        factors.add(gtsam.CustomFactor(noise, [int(pair[0]), int(pair[1])], _g2o_error(z)))
    return factors


def values(nodes: Array) -> Any:
    result = gtsam.Values()
    for k, pose in enumerate(nodes):
        result.insert(k, gtsam.Pose2(*pose))
    return result


def poses(result: Any) -> Array:
    found = (result.atPose2(k) for k in range(result.size()))
    return np.array([[pose.x(), pose.y(), pose.theta()] for pose in found])


def _anchored(graph: Graph) -> Any:
    factors = gtsam.NonlinearFactorGraph()
    factors.add(gtsam.NonlinearEqualityPose2(0, gtsam.Pose2(*graph.nodes[0])))
    return factors


def _g2o_error(z: Array) -> Any:
    back = inverse(z)
    step = 1e-6
    # Right perturbations of one end, six of them, whose translation is plain: equal to exp to first order.
    steps = np.concatenate([np.eye(3), -np.eye(3)]) * step
    still = np.zeros((6, 3))

    def error(factor: Any, state: Any, jacobians: list[Array] | None) -> Array:
        ends = [state.atPose2(key) for key in factor.keys()]  # noqa: SIM118
        first, second = (np.array([pose.x(), pose.y(), pose.theta()]) for pose in ends)
        if jacobians is not None:
            for end, (a, b) in enumerate([(steps, still), (still, steps)]):
                moved = compose(back, compose(inverse(compose(first, a)), compose(second, b)))
                jacobians[end] = np.asfortranarray(((moved[:3] - moved[3:]) / (2.0 * step)).T)
        found: Array = compose(back, compose(inverse(first), second))
        return found

    return error

"""The pose graph against GTSAM on two graphs of the Intel laboratory."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groma import _core
from pose_graphs import Array, Graph, between, read_g2o, with_false_closures, wrap

gtsam = pytest.importorskip("gtsam")
from oracle import gtsam_graphs  # noqa: E402

pytestmark = pytest.mark.shared
FILES = ["sesync_intel.g2o.gz", "carlone_input_INTEL.g2o.gz"]


def load(shared: Path, name: str) -> Graph:
    return read_g2o(shared / "data" / "posegraph" / name)


def solve(graph: Graph) -> tuple[Array, Array, Array]:
    nodes, chi_squares, weights, _, converged = _core.pose_graph_optimize(graph.nodes, *graph.edges, graph.robust)
    assert converged
    return nodes, chi_squares, weights


def trusting(graph: Graph) -> Graph:
    return replace(graph, robust=np.zeros(len(graph.pairs), dtype=bool))


def minimum(factors: Any, start: Any, optimizer: str) -> tuple[float, Array]:
    """Cost and poses; on QR, for the second file is too ill-conditioned for GTSAM's Cholesky."""
    parameters = getattr(gtsam, f"{optimizer}Params")()
    parameters.setLinearSolverType("MULTIFRONTAL_QR")
    parameters.setRelativeErrorTol(1e-9)
    found = getattr(gtsam, f"{optimizer}Optimizer")(factors, start, parameters).optimize()
    return 2.0 * factors.error(found), gtsam_graphs.poses(found)


@pytest.mark.parametrize("name", FILES)
def test_same_minimum_with_the_error_of_g2o(shared: Path, name: str) -> None:
    """GTSAM finds its way back to the same poses from a start a little off them."""
    graph = trusting(load(shared, name))
    nodes, chi_squares, _ = solve(graph)
    factors = gtsam_graphs.g2o_factors(graph)
    start = nodes + np.random.default_rng(0).normal(scale=1e-4, size=nodes.shape) * (np.arange(len(nodes)) > 0)[:, None]
    expected, poses = minimum(factors, gtsam_graphs.values(start), "GaussNewton")
    assert chi_squares.sum() == pytest.approx(expected, rel=1e-6)
    assert np.abs(between(nodes, poses)).max() < 1e-5


def test_same_covariances(shared: Path) -> None:
    """On the first file; GTSAM calls the second one indeterminate."""
    graph = trusting(load(shared, FILES[0]))
    nodes, _, weights = solve(graph)
    marginals = gtsam.Marginals(gtsam_graphs.g2o_factors(graph), gtsam_graphs.values(nodes))
    covariances = _core.pose_graph_marginals(nodes, *graph.edges, weights)
    for node in range(1, len(nodes), 97):
        expected = marginals.marginalCovariance(node)
        assert np.abs(covariances[node] - expected).max() < 1e-5 * np.abs(expected).max(), node


@pytest.mark.parametrize("name", FILES)
def test_same_minimum_from_the_start_of_the_file(shared: Path, name: str) -> None:
    """By GTSAM's dogleg, the only one of its optimisers that solves the second file from its start.

    GTSAM's error differs from g2o's by second-order terms: the costs agree to 1e-4, the poses to 1 or 2 cm.
    """
    graph = trusting(load(shared, name))
    nodes, chi_squares, _ = solve(graph)
    expected, poses = minimum(gtsam_graphs.between_factors(graph), gtsam_graphs.values(graph.nodes), "Dogleg")
    assert chi_squares.sum() == pytest.approx(expected, rel=1e-4)
    difference = nodes - poses
    assert np.abs(difference[:, :2]).max() < 2e-2
    assert np.abs(wrap(difference[:, 2])).max() < 2e-2


@pytest.mark.parametrize("share", [0.1, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_false_closures_are_left_out(shared: Path, share: float, seed: int) -> None:
    """The information of this file is far too small (chi-square 45 with 2355 degrees of freedom): scaled up."""
    graph = load(shared, "sesync_intel.g2o.gz")
    graph = replace(graph, information=graph.information * 10.0)
    spoiled = with_false_closures(graph, int(share * graph.robust.sum()), np.random.default_rng(seed))
    expected, _, _ = solve(trusting(graph))
    nodes, _, weights = _core.pose_graph_optimize(
        spoiled.nodes, *spoiled.edges, spoiled.robust, inlier_chi_square=25.0
    )[:3]
    assert (weights[: len(graph.pairs)] == 1.0).all()
    assert (weights[len(graph.pairs) :] == 0.0).all()
    assert np.abs(between(expected, nodes)).max() < 1e-5

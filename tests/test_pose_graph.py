"""The pose graph on made drives whose truth is known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from groma import _core
from groma.errors import EstimationError
from pose_graphs import Array, Graph, between, city, compose, dead_reckoned, inverse, with_false_closures, wrap

SIGMAS = (0.05, 0.03, 0.01)


def optimize(graph: Graph, **options: float) -> tuple[Array, Array, Array]:
    nodes, chi_squares, weights, _, converged = _core.pose_graph_optimize(
        graph.nodes,
        graph.pairs,
        graph.measurements,
        graph.information,
        graph.robust,
        **options,  # type: ignore[arg-type]
    )
    assert converged
    return nodes, chi_squares, weights


def trusting(graph: Graph) -> Graph:
    return replace(graph, robust=np.zeros(len(graph.pairs), dtype=bool))


def largest(difference: Array) -> float:
    return float(np.abs(np.concatenate([difference[..., :2], wrap(difference[..., 2:])], axis=-1)).max())


@pytest.mark.parametrize("robust", [False, True])
def test_recovers_exact_measurements(robust: bool) -> None:
    rng = np.random.default_rng(1)
    graph = city(300, 100, rng, SIGMAS)
    first, second = graph.pairs.T
    flipped = rng.random(len(first)) < 0.3
    graph.pairs[flipped] = graph.pairs[flipped][:, ::-1]
    first, second = graph.pairs.T
    truth = graph.nodes
    start = compose(truth, rng.normal(size=truth.shape) * [0.3, 0.3, 0.1])
    start[0] = truth[0]
    exact = replace(graph, nodes=start, measurements=between(truth[first], truth[second]))
    nodes, chi_squares, weights = optimize(exact if robust else trusting(exact))
    assert largest(nodes - truth) < 1e-9
    assert chi_squares.max() < 1e-12
    assert (weights == 1.0).all()


def test_holds_the_first_node_and_repeats_itself() -> None:
    graph = trusting(dead_reckoned(city(200, 80, np.random.default_rng(2), SIGMAS)))
    graph.nodes[:] = compose(np.array([5.0, -2.0, 2.5]), graph.nodes)
    once, again = optimize(graph), optimize(graph)
    assert (once[0][0, :2] == graph.nodes[0, :2]).all()
    assert all(a.tobytes() == b.tobytes() for a, b in zip(once, again, strict=True))


def test_covariances_are_those_of_the_errors() -> None:
    """NEES of single nodes over independent runs: mean 3, standard deviation sqrt(6 / runs); band of 4 of these."""
    runs, watched = 300, [1, 20, 40, 60, 79]
    nees = np.zeros((runs, len(watched)))
    for run in range(runs):
        graph = city(80, 30, np.random.default_rng([3, run]), (0.02, 0.03, 0.01))
        nodes, _, weights = optimize(trusting(dead_reckoned(graph)))
        covariances = _core.pose_graph_marginals(nodes, *graph.edges, weights)
        error = between(nodes, graph.nodes)[watched]
        nees[run] = np.einsum("ki,kij,kj->k", error, np.linalg.inv(covariances[watched]), error)
        assert (covariances[0] == 0.0).all()
    assert np.abs(nees.mean(axis=0) - 3.0).max() < 4.0 * np.sqrt(6.0 / runs)


def test_covariance_of_a_chain_is_propagated() -> None:
    first, second = np.array([1.0, 2.0, 0.7]), np.array([3.0, -1.0, -2.0])
    nodes = np.stack([np.zeros(3), first, compose(first, second)])
    covariances = np.array([np.diag([0.1, 0.2, 0.3]), [[0.3, 0.1, 0.0], [0.1, 0.2, 0.05], [0.0, 0.05, 0.1]]])
    pairs, edges = np.array([[0, 1], [1, 2]]), np.stack([first, second])
    marginals = _core.pose_graph_marginals(nodes, pairs, edges, np.linalg.inv(covariances), np.ones(2))
    x, y, theta = inverse(second)
    c, s = np.cos(theta), np.sin(theta)
    adjoint = np.array([[c, -s, y], [s, c, -x], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(marginals[1], covariances[0], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(
        marginals[2], adjoint @ covariances[0] @ adjoint.T + covariances[1], rtol=1e-12, atol=1e-14
    )


@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_false_closures_are_left_out(share: float, seed: int) -> None:
    rng = np.random.default_rng([4, seed])
    true = city(400, 150, rng, SIGMAS)
    graph = dead_reckoned(with_false_closures(true, int(share * true.robust.sum()), rng))
    nodes, _, weights = optimize(graph, inlier_chi_square=25.0)
    expected, _, _ = optimize(trusting(dead_reckoned(true)))
    assert (weights[: len(true.pairs)] == 1.0).all()
    assert (weights[len(true.pairs) :] == 0.0).all()
    assert largest(nodes - expected) < 1e-6


def test_a_good_start_is_not_made_worse() -> None:
    """A third false, agreeing on one shift of everything they touch; the start is the true arrangement."""
    rng = np.random.default_rng(5)
    true = city(300, 40, rng, SIGMAS)
    graph = with_false_closures(true, 20, rng)
    shifted = compose(true.nodes, np.array([6.0, 3.0, 0.5]))
    ends = graph.pairs[-20:] = np.stack([np.arange(20), np.arange(200, 220)], axis=1)
    graph.measurements[-20:] = between(true.nodes[ends[:, 0]], shifted[ends[:, 1]])
    _, _, weights = optimize(graph, inlier_chi_square=25.0)
    assert (weights[: len(true.pairs)] == 1.0).all()
    assert (weights[-20:] == 0.0).all()


def test_a_new_closure_after_long_drift_is_taken_in() -> None:
    """One true closure at the end of a long loop: its error at the start is many times its own sigma."""
    graph = city(400, 0, np.random.default_rng(6), SIGMAS)
    true_edge = between(graph.nodes[5], graph.nodes[-1])
    graph = dead_reckoned(graph)
    graph = Graph(
        graph.nodes,
        np.concatenate([graph.pairs, [[5, 399]]]),
        np.concatenate([graph.measurements, [true_edge]]),
        np.concatenate([graph.information, graph.information[:1]]),
        np.concatenate([graph.robust, [True]]),
    )
    gap = between(graph.nodes[5], graph.nodes[-1]) - true_edge
    assert np.abs(gap / SIGMAS).max() > 10.0
    nodes, chi_squares, weights = optimize(graph)
    assert weights[-1] == 1.0
    assert chi_squares[-1] < 1.0
    assert largest(between(nodes[5], nodes[-1]) - true_edge) < 0.05


def test_edges_may_measure_less_than_a_pose() -> None:
    """Closures that know the position only, or the heading only."""
    graph = city(200, 60, np.random.default_rng(7), SIGMAS)
    graph.information[199:230, 2, :] = graph.information[199:230, :, 2] = 0.0
    graph.information[230:, :2, :] = graph.information[230:, :, :2] = 0.0
    free = dead_reckoned(graph)
    nodes, _, weights = optimize(free, inlier_chi_square=25.0)
    assert (weights == 1.0).all()
    drift = np.linalg.norm(between(graph.nodes, free.nodes)[:, :2], axis=1).max()
    assert np.linalg.norm(between(graph.nodes, nodes)[:, :2], axis=1).max() < drift / 2


def test_a_single_node_is_its_own_solution() -> None:
    lone = Graph(
        np.array([[1.0, 2.0, 3.0]]),
        np.zeros((0, 2), dtype=np.int64),
        np.zeros((0, 3)),
        np.zeros((0, 3, 3)),
        np.zeros(0, dtype=bool),
    )
    nodes, chi_squares, _ = optimize(lone)
    assert largest(nodes - lone.nodes) < 1e-15
    assert chi_squares.shape == (0,)
    assert _core.pose_graph_marginals(nodes, *lone.edges, chi_squares).shape == (1, 3, 3)


def small() -> Graph:
    return trusting(city(12, 0, np.random.default_rng(8), SIGMAS))


def without(graph: Graph, edge: int) -> Graph:
    kept = np.arange(len(graph.pairs)) != edge
    return Graph(graph.nodes, graph.pairs[kept], graph.measurements[kept], graph.information[kept], graph.robust[kept])


def test_what_is_not_determined_is_named() -> None:
    graph = small()
    with pytest.raises(EstimationError, match="node 7"):
        optimize(without(graph, 6))
    with pytest.raises(EstimationError, match="node 7"):
        _core.pose_graph_marginals(graph.nodes, *graph.edges, (np.arange(11) != 6).astype(float))
    graph.information[10] = np.diag([1.0, 1.0, 0.0])
    with pytest.raises(EstimationError, match=r"node 11 .* free"):
        optimize(graph)


@pytest.mark.parametrize(
    ("field", "index", "value", "message"),
    [
        ("nodes", (3, 1), np.nan, "node 3"),
        ("pairs", (4, 1), 12, "edge 4.*no node 12"),
        ("pairs", (4, 1), -1, "edge 4 has a negative node"),
        ("pairs", (4, 1), 4, "edge 4.*itself"),
        ("measurements", (5, 2), np.inf, "edge 5.*measurement is not finite"),
        ("information", (6, 0, 0), np.nan, "edge 6.*information matrix is not finite"),
        ("information", (6, 0, 0), -1.0, "edge 6.*eigenvalues"),
        ("information", (6, 0, 1), 1.0, "edge 6.*symmetric"),
    ],
)
def test_bad_input_is_named(field: str, index: tuple[int, ...], value: float, message: str) -> None:
    graph = small()
    getattr(graph, field)[index] = value
    with pytest.raises(ValueError, match=message):
        optimize(graph)


def test_bad_shapes_and_options_are_refused() -> None:
    graph = small()
    with pytest.raises(ValueError, match="no nodes"):
        optimize(replace(graph, nodes=np.zeros((0, 3))))
    with pytest.raises(ValueError, match="measurements must be"):
        optimize(replace(graph, measurements=graph.measurements[1:]))
    with pytest.raises(ValueError, match="as many weights"):
        _core.pose_graph_marginals(graph.nodes, *graph.edges, np.ones(3))
    for name in json.loads(_core.pose_graph_defaults()):
        with pytest.raises(ValueError, match=name):
            optimize(graph, **{name: 0})

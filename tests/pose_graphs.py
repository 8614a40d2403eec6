"""Pose graphs for the tests: made ones, and those of g2o files."""

from __future__ import annotations

import gzip
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Graph:
    """Nodes (N, 3), pairs (M, 2), measurements (M, 3), information (M, 3, 3), robust (M,)."""

    nodes: Array
    pairs: NDArray[np.int64]
    measurements: Array
    information: Array
    robust: NDArray[np.bool_]

    @property
    def edges(self) -> tuple[NDArray[np.int64], Array, Array]:
        return self.pairs, self.measurements, self.information


def compose(a: Array, b: Array) -> Array:
    """(..., 3) poses ``a * b``."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    x = a[..., 0] + c * b[..., 0] - s * b[..., 1]
    y = a[..., 1] + s * b[..., 0] + c * b[..., 1]
    return np.stack([x, y, wrap(a[..., 2] + b[..., 2])], axis=-1)


def inverse(a: Array) -> Array:
    """(..., 3) poses ``a^-1``."""
    c, s = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack([-c * a[..., 0] - s * a[..., 1], s * a[..., 0] - c * a[..., 1], -a[..., 2]], axis=-1)


def between(a: Array, b: Array) -> Array:
    """(..., 3) poses ``a^-1 * b``."""
    return compose(inverse(a), b)


def wrap(angle: Array) -> Array:
    """Angles in [-pi, pi)."""
    wrapped: Array = (angle + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped


def city(nodes: int, closures: int, rng: np.random.Generator, sigmas: tuple[float, float, float]) -> Graph:
    """A drive on the streets of a grid with closures at second visits; its nodes are true, its measurements noisy.

    The noise is drawn so that the error of an edge at the true nodes is Gaussian with exactly its covariance.
    """
    truth = _drive(nodes, rng)
    first, second = np.triu_indices(nodes, 10)
    near = np.hypot(*(truth[first, :2] - truth[second, :2]).T) < 1.5
    chosen = rng.permutation(np.flatnonzero(near))[:closures]
    chain = np.stack([np.arange(nodes - 1), np.arange(1, nodes)], axis=1)
    pairs = np.concatenate([chain, np.stack([first[chosen], second[chosen]], axis=1)]).astype(np.int64)
    error = rng.normal(size=(len(pairs), 3)) * sigmas
    measurements = compose(between(truth[pairs[:, 0]], truth[pairs[:, 1]]), inverse(error))
    information = np.broadcast_to(np.diag(np.array(sigmas) ** -2.0), (len(pairs), 3, 3)).copy()
    return Graph(truth, pairs, measurements, information, np.arange(len(pairs)) >= nodes - 1)


def dead_reckoned(graph: Graph) -> Graph:
    """The same graph with the nodes that its chain alone gives."""
    nodes = graph.nodes.copy()
    for k in range(1, len(nodes)):
        nodes[k] = compose(nodes[k - 1], graph.measurements[k - 1])
    return replace(graph, nodes=nodes)


def with_false_closures(graph: Graph, count: int, rng: np.random.Generator) -> Graph:
    """The graph with `count` robust edges more, between random nodes and with random measurements."""
    pairs = rng.integers(0, len(graph.nodes), size=(10 * count, 2))
    pairs = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 5][:count]
    measurements = np.concatenate([rng.uniform(-4, 4, (count, 2)), rng.uniform(-np.pi, np.pi, (count, 1))], axis=1)
    information = np.broadcast_to(np.median(graph.information[graph.robust], axis=0), (count, 3, 3))
    return Graph(
        graph.nodes,
        np.concatenate([graph.pairs, pairs]),
        np.concatenate([graph.measurements, measurements]),
        np.concatenate([graph.information, information]),
        np.concatenate([graph.robust, np.ones(count, dtype=bool)]),
    )


def read_g2o(path: Path) -> Graph:
    """The VERTEX_SE2 and EDGE_SE2 of a gzipped g2o file; edges that skip a node are robust."""
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        words = [line.split() for line in lines]
    nodes = np.array(sorted([float(v) for v in w[1:5]] for w in words if w[0] == "VERTEX_SE2"))
    edges = np.array([[float(v) for v in w[1:12]] for w in words if w[0] == "EDGE_SE2"])
    pairs = np.searchsorted(nodes[:, 0], edges[:, :2]).astype(np.int64)
    upper = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    return Graph(nodes[:, 1:].copy(), pairs, edges[:, 2:5].copy(), edges[:, 5:][:, upper], np.ptp(pairs, axis=1) > 1)


def _drive(nodes: int, rng: np.random.Generator) -> Array:
    side = np.sqrt(nodes) / 2.0
    step = np.array([1.0, 0.0, 0.0])
    poses = np.zeros((nodes, 3))
    for k in range(1, nodes):
        pose = poses[k - 1].copy()
        if k % 3 == 0:
            pose[2] += rng.choice([0.0, np.pi / 2, -np.pi / 2])
        if np.abs(compose(pose, 3 * step)[:2]).max() > side:
            pose[2] += np.pi / 2
        poses[k] = compose(pose, step)
    return poses

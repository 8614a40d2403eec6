"""Pose graphs in the plane as g2o text: ``VERTEX_SE2``, ``EDGE_SE2``, ``FIX``.

    VERTEX_SE2 id x y theta
    EDGE_SE2 i j dx dy dtheta  I11 I12 I13 I22 I23 I33
    FIX id [id ...]

Metres, radians; the edge is T_i_j, its error z^-1 (x_i^-1 x_j); I is the information (not the covariance), the upper
triangle row by row, order x, y, theta. Source: g2o, core/optimizable_graph.cpp and types/slam2d.

Lines of other tags are skipped with one warning a tag. Refused, because a guess would be silently wrong: TORO files
(``VERTEX2``, ``EDGE2``: the information has another order) and graphs in space.
"""

from __future__ import annotations

import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.table import floats, lines
from groma.nouns.arrays import Array
from groma.nouns.bounds import in_file, require, require_all

Indices = NDArray[np.int64]

_UPPER = np.triu_indices(3)
_REFUSED = {
    "VERTEX2": "a TORO file, whose information has another order: convert it to EDGE_SE2 first",
    "EDGE2": "a TORO file, whose information has another order: convert it to EDGE_SE2 first",
    "VERTEX_SE3:QUAT": "a graph in space; groma maps in the plane: export it as VERTEX_SE2 / EDGE_SE2",
    "EDGE_SE3:QUAT": "a graph in space; groma maps in the plane: export it as VERTEX_SE2 / EDGE_SE2",
}


@dataclass(frozen=True, slots=True)
class Graph:
    """A pose graph as the file has it."""

    ids: Indices
    """(N,) names of the vertices, in the order of the file."""
    poses: Array
    """(N, 3)."""
    pairs: Indices
    """(M, 2) ids from, to."""
    measurements: Array
    """(M, 3) T_from_to."""
    information: Array
    """(M, 3, 3)."""
    fixed: tuple[int, ...] = ()
    skipped: dict[str, int] = field(default_factory=dict)
    """Lines that were not understood, by tag."""


def read_g2o(path: Path) -> Graph:
    """Read a planar pose graph, plain or gzipped.

    Raises
    ------
    UserError
        Naming file and line, when the graph is malformed, empty, in space or of TORO.
    """
    reader = _Reader(path)
    for number, fields in lines(path):
        reader.line(number, fields)
    return reader.graph()


def write_g2o(path: Path, graph: Graph) -> None:
    """Write a pose graph; every number is the shortest text that reads back as the same number."""
    text = [_line("VERTEX_SE2", [i], pose) for i, pose in zip(graph.ids.tolist(), graph.poses.tolist(), strict=True)]
    if graph.fixed:
        text.append(_line("FIX", list(graph.fixed), []))
    values = np.hstack([graph.measurements, graph.information[:, *_UPPER]])
    text += [_line("EDGE_SE2", pair, row) for pair, row in zip(graph.pairs.tolist(), values.tolist(), strict=True)]
    write_text(path, "".join(text))


def _line(tag: str, ids: list[int], values: list[float]) -> str:
    return " ".join([tag, *map(str, ids), *map(repr, values)]) + "\n"


class _Reader:
    """What was read of one file so far."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.vertices: dict[int, list[float]] = {}
        self.edges: list[tuple[int, int, int, list[float]]] = []
        self.fixed: list[int] = []
        self.skipped: Counter[str] = Counter()

    def line(self, number: int, fields: list[str]) -> None:
        tag, values = fields[0], fields[1:]
        if tag == "VERTEX_SE2":
            self._vertex(number, values)
        elif tag == "EDGE_SE2":
            self._edge(number, values)
        elif tag == "FIX":
            self.fixed += [self._id(number, value) for value in values]
        elif tag in _REFUSED:
            raise UserError(f"{self.path}:{number}: {tag} is {_REFUSED[tag]}")
        else:
            self.skipped[tag] += 1

    def graph(self) -> Graph:
        if not self.vertices:
            raise UserError(f"{self.path}: no VERTEX_SE2 line: not a g2o pose graph of the plane")
        for number, i, j, _ in self.edges:
            for name in (i, j):
                if name not in self.vertices:
                    raise UserError(f"{self.path}:{number}: EDGE_SE2 to vertex {name}, which the file does not have")
        for tag, count in self.skipped.items():
            warnings.warn(f"{self.path}: {count} lines of {tag} skipped: groma does not use them", stacklevel=3)
        values = np.array([edge[3] for edge in self.edges], dtype=np.float64).reshape(-1, 9)
        return Graph(
            np.array(list(self.vertices), dtype=np.int64),
            np.array(list(self.vertices.values())),
            np.array([edge[1:3] for edge in self.edges], dtype=np.int64).reshape(-1, 2),
            values[:, :3],
            _symmetric(values[:, 3:]),
            tuple(self.fixed),
            dict(self.skipped),
        )

    def _vertex(self, number: int, values: list[str]) -> None:
        numbers = self._numbers(number, "VERTEX_SE2", values, 1, 3)
        name = self._id(number, values[0])
        if name in self.vertices:
            raise UserError(f"{self.path}:{number}: vertex {name} comes twice")
        self.vertices[name] = numbers

    def _edge(self, number: int, values: list[str]) -> None:
        numbers = self._numbers(number, "EDGE_SE2", values, 2, 9)
        i, j = self._id(number, values[0]), self._id(number, values[1])
        if i == j:
            raise UserError(f"{self.path}:{number}: EDGE_SE2 from vertex {i} to itself")
        self.edges.append((number, i, j, numbers))

    def _numbers(self, number: int, tag: str, values: list[str], ids: int, count: int) -> list[float]:
        if len(values) != ids + count:
            raise UserError(f"{self.path}:{number}: {tag} has {len(values)} fields, expected {ids + count}")
        numbers = floats(self.path, number, values[ids:])
        with in_file(self.path, number):
            require_all("coordinate", f"{tag} x, y, theta", numbers[:3])
            require_all("information", f"{tag} information", numbers[3:])
        return numbers

    def _id(self, number: int, text: str) -> int:
        if not text.isdecimal():
            raise UserError(f"{self.path}:{number}: {text} is no vertex id; ids are whole numbers from 0")
        with in_file(self.path, number):
            require("identity", "vertex id", int(text[:20]))
        return int(text)


def _symmetric(upper: Array) -> Array:
    matrices = np.empty((len(upper), 3, 3))
    for column, (i, j) in enumerate(zip(*_UPPER, strict=True)):
        matrices[:, i, j] = matrices[:, j, i] = upper[:, column]
    return matrices

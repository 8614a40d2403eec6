from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.g2o import Graph, read_g2o, write_g2o


def test_round_trip_is_exact(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    square_root = rng.normal(size=(3, 3, 3))
    information = square_root @ square_root.transpose(0, 2, 1) * 1e7
    information = (information + information.transpose(0, 2, 1)) / 2
    graph = Graph(
        np.array([0, 7, 3]),
        rng.normal(size=(3, 3)) / 3,
        np.array([[0, 7], [7, 3], [3, 0]]),
        rng.normal(size=(3, 3)) * 1e-9,
        information,
        fixed=(0, 3),
    )
    path = tmp_path / "g.g2o"
    write_g2o(path, graph)
    read = read_g2o(path)
    for name in ("ids", "poses", "pairs", "measurements", "information"):
        np.testing.assert_array_equal(getattr(read, name), getattr(graph, name))
    assert read.fixed == (0, 3)
    assert read.skipped == {}


def test_a_graph_without_edges_and_vertices_after_edges(tmp_path: Path) -> None:
    path = tmp_path / "g.g2o"
    path.write_text("VERTEX_SE2 0 0 0 0\n")
    assert read_g2o(path).pairs.shape == (0, 2)
    path.write_text("EDGE_SE2 0 1 1 2 3 1 0 0 2 0 3\nVERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 2 3\n")
    read = read_g2o(path)
    np.testing.assert_array_equal(read.information, [np.diag([1.0, 2.0, 3.0])])


def test_the_upper_triangle_goes_row_by_row(tmp_path: Path) -> None:
    path = tmp_path / "g.g2o"
    path.write_text("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nEDGE_SE2 0 1 0 0 0 11 12 13 22 23 33\n")
    assert read_g2o(path).information[0].tolist() == [[11, 12, 13], [12, 22, 23], [13, 23, 33]]


def test_unknown_tags_are_skipped_with_one_warning_each(tmp_path: Path) -> None:
    path = tmp_path / "g.g2o.gz"
    lines = "VERTEX_SE2 0 0 0 0\nROBOTLASER1 0 1 2\nVERTEX_XY 5 1 1\nROBOTLASER1 0 1 2\n"
    path.write_bytes(gzip.compress(lines.encode()))
    with pytest.warns(UserWarning, match="skipped") as caught:
        read = read_g2o(path)
    assert read.skipped == {"ROBOTLASER1": 2, "VERTEX_XY": 1}
    assert [str(w.message).removeprefix(f"{path}: ") for w in caught] == [
        "2 lines of ROBOTLASER1 skipped: groma does not use them",
        "1 lines of VERTEX_XY skipped: groma does not use them",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no VERTEX_SE2"),
        ("VERTEX2 0 0 0 0\n", "g.g2o:1: VERTEX2 is a TORO file"),
        ("VERTEX_SE2 0 0 0 0\nEDGE2 0 1 0 0 0 1 0 1 1 0 0\n", "g.g2o:2: EDGE2 is a TORO file"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", "in the plane"),
        ("VERTEX_SE2 0 0 0\n", "g.g2o:1: VERTEX_SE2 has 3 fields, expected 4"),
        ("VERTEX_SE2 a 0 0 0\n", "a is no vertex id"),
        ("VERTEX_SE2 0 0 nan 0\n", "g.g2o:1: VERTEX_SE2 x, y, theta.1. = nan"),
        ("VERTEX_SE2 0 0 zero 0\n", "g.g2o:1: not a number: 'zero'"),
        ("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 0 0 0\n", "g.g2o:2: vertex 0 comes twice"),
        ("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 9 0 0 0 1 0 0 1 0 1\n", "g.g2o:2: EDGE_SE2 to vertex 9"),
        ("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 0 0 0 0 1 0 0 1 0 1\n", "to itself"),
    ],
)
def test_names_the_fault(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "g.g2o"
    path.write_text(text)
    with pytest.raises(UserError, match=message):
        read_g2o(path)


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "nodes", "edges"), [("sesync_intel.g2o.gz", 1728, 2512), ("carlone_input_INTEL.g2o.gz", 1228, 1483)]
)
def test_reads_published_graphs(shared: Path, name: str, nodes: int, edges: int) -> None:
    graph = read_g2o(shared / "data" / "posegraph" / name)
    assert (len(graph.ids), len(graph.pairs)) == (nodes, edges)
    assert (np.linalg.eigvalsh(graph.information) > 0).all()

"""The files of a map read back as the map."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groma.io.g2o import read_g2o
from groma.io.landmarks import read_landmarks
from groma.io.nav2_map import read_map
from groma.io.trajectory import read_tum
from groma.runs.map_files import save_map
from ring_corridor import ring_corridor


def test_every_file_reads_back_as_the_result(tmp_path: Path) -> None:
    result = ring_corridor(400)
    save_map(result, tmp_path)
    np.testing.assert_allclose(read_tum(tmp_path / "trajectory.tum").poses, result.trajectory, atol=3e-9)
    graph = read_g2o(tmp_path / "graph.g2o")
    np.testing.assert_array_equal(graph.poses, result.graph.poses)
    np.testing.assert_array_equal(graph.information, result.graph.information)
    assert graph.fixed == (0,)
    np.testing.assert_array_equal(read_map(tmp_path / "map.yaml").cells, result.grid.cells)
    np.testing.assert_array_equal(read_landmarks(tmp_path / "landmarks.json").seen, result.landmarks.seen)


def test_same_result_same_bytes_and_nothing_else_is_left(tmp_path: Path) -> None:
    made = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        save_map(ring_corridor(400), tmp_path / name)
        made.append({path.name: path.read_bytes() for path in (tmp_path / name).iterdir()})
    assert made[0] == made[1]
    assert set(made[0]) == {"trajectory.tum", "graph.g2o", "map.yaml", "map.pgm", "landmarks.json"}

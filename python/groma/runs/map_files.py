"""The files of a map: what `groma map` leaves beside what every run leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groma.io.g2o import Graph, write_g2o
from groma.io.landmarks import write_landmarks
from groma.io.nav2_map import write_map
from groma.io.trajectory import Trajectory, write_tum
from groma.mapping.known_poses import Surveyed
from groma.mapping.result import MapResult, PoseGraph


def save_map(result: MapResult, directory: Path) -> None:
    """Write trajectory, pose graph, occupancy and landmarks into a folder that exists.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    write_tum(directory / "trajectory.tum", result.trajectory_stamps, result.trajectory)
    write_g2o(directory / "graph.g2o", to_g2o(result.graph))
    write_map(directory / "map.yaml", result.grid)
    write_landmarks(directory / "landmarks.json", result.landmarks)


def save_survey(result: Surveyed, trajectory: Trajectory, directory: Path) -> None:
    """Write the files of a map at known poses into a folder that exists.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    write_tum(directory / "trajectory.tum", trajectory.stamps, trajectory.poses)
    write_map(directory / "map.yaml", result.grid)
    write_landmarks(directory / "landmarks.json", result.landmarks)


def to_g2o(graph: PoseGraph) -> Graph:
    """Return the graph with its nodes numbered from 0 and the first one fixed."""
    ids = np.arange(len(graph.poses))
    return Graph(ids, graph.poses, graph.pairs, graph.measurements, graph.information, (0,) if len(ids) else ())

"""A building to explore from a file: a graph written by hand, or the middle lines of a nav2 map.

A yaml file that names an `image` near its begin is a nav2 map, any other a graph (`groma.io.camera_graph`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from groma.errors import UserError
from groma.io.camera_graph import read_graph
from groma.io.nav2_map import read_map
from groma.nouns.building import Graph
from groma.nouns.findings import Finding
from groma.nouns.maps import OccupancyGrid
from groma.planning.skeleton import graph_of_map


@dataclass(frozen=True, slots=True)
class Building:
    """Places and ways, and where they come from."""

    graph: Graph
    grid: OccupancyGrid | None = None
    """The map that they were taken from."""
    notes: tuple[Finding, ...] = ()
    """What was assumed and left out."""


def read_building(path: Path) -> Building:
    """Read a building.

    Raises
    ------
    UserError
        When the file is neither, or no robot can drive the building.
    """
    if not _is_map(path):
        return Building(read_graph(path))
    graph, notes = graph_of_map(path)
    return Building(graph, read_map(path), notes)


def _is_map(path: Path) -> bool:
    try:
        return "image:" in path.read_text("utf-8", errors="replace")[:2000]
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from error

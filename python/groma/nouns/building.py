"""A building as a graph: places where a robot can stand, some seen by a camera, and the paths between them."""

from __future__ import annotations

import msgspec

from groma import _core
from groma.errors import UserError


class Node(msgspec.Struct, frozen=True):
    """A place: its position [m] and whether a camera sees a robot there."""

    position: tuple[float, float]
    camera: bool = True


class Edge(msgspec.Struct, frozen=True):
    """A way between two places (indices), straight from bend to bend [m]."""

    ends: tuple[int, int]
    via: tuple[tuple[float, float], ...] = ()


class Graph(msgspec.Struct, frozen=True):
    """A building: places, ways, and the place where the robot starts."""

    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    start: int = 0
    names: tuple[str, ...] = ()
    """Names of the places, for people; may be empty."""

    def json(self) -> str:
        """Return what the core reads: the graph without names."""
        return msgspec.json.encode({"nodes": self.nodes, "edges": self.edges, "start": self.start}).decode()


def check(graph: Graph) -> None:
    """Refuse a graph that cannot be driven.

    Raises
    ------
    UserError
        Saying which place or way is wrong.
    """
    try:
        _core.exploration_check(graph.json())
    except ValueError as error:
        raise UserError(str(error)) from error

"""A building as a graph of cameras and ways, written by hand: a yaml file.

    start: dock
    nodes:
      dock: [0, 0]
      hall: [8, 0]
      door: {at: [8, 6], camera: false}
    edges:
      - [dock, hall]
      - {between: [hall, door], via: [[9, 2], [9, 4]]}

A place is its position in metres, and has a camera unless it says otherwise; a way is straight between its bends.
`start` is the place where the robot starts, the first one when left out. Names are free.
The file may contain nothing else.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.table import read_bytes
from groma.nouns.bounds import in_file, require_all
from groma.nouns.building import Edge, Graph, Node, check

Point = tuple[float, float]


class _Place(msgspec.Struct, forbid_unknown_fields=True):
    at: Point
    camera: bool = True


class _Way(msgspec.Struct, forbid_unknown_fields=True):
    between: tuple[str, str]
    via: list[Point] = []


class _File(msgspec.Struct, forbid_unknown_fields=True):
    nodes: dict[str, object]
    edges: list[object] = []
    start: str | None = None


def read_graph(path: Path) -> Graph:
    """Read a building.

    Raises
    ------
    UserError
        When the file is missing or malformed, naming the key, or no robot can drive the building.
    """
    content = _content(path)
    if not content.nodes:
        raise UserError(f"{path}: has no nodes: write at least two, as `name: [x, y]`")
    names = list(content.nodes)
    nodes = tuple(_node(path, name, value) for name, value in content.nodes.items())
    edges = tuple(_edge(path, names, i, value) for i, value in enumerate(content.edges))
    start = _index(path, names, content.start or names[0], "start")
    graph = Graph(nodes, edges, start, tuple(names))
    try:
        check(graph)
    except UserError as error:
        raise UserError(f"{path}: {error} (places and ways are numbered from 0 in the order of the file)") from error
    return graph


def write_graph(path: Path, graph: Graph) -> None:
    """Write a building such that `read_graph` returns it."""
    names = node_names(graph)
    lines = [f"start: {names[graph.start]}", "nodes:"]
    for name, node in zip(names, graph.nodes, strict=True):
        at = _point(node.position)
        lines.append(f"  {name}: {at}" if node.camera else f"  {name}: {{at: {at}, camera: false}}")
    lines.append("edges:")
    for edge in graph.edges:
        ends = f"[{names[edge.ends[0]]}, {names[edge.ends[1]]}]"
        via = ", ".join(map(_point, edge.via))
        lines.append(f"  - {{between: {ends}, via: [{via}]}}" if edge.via else f"  - {ends}")
    write_text(path, "\n".join(lines) + "\n")


def node_names(graph: Graph) -> tuple[str, ...]:
    """Return the names of the places; those without are called c0, c1, ... (cameras) and j0, ... (junctions)."""
    if graph.names:
        return graph.names
    return tuple(f"{'c' if node.camera else 'j'}{i}" for i, node in enumerate(graph.nodes))


def _content(path: Path) -> _File:
    try:
        values = YAML(typ="safe", pure=True).load(read_bytes(path).decode(errors="replace"))
        return msgspec.convert(values, _File)
    except YAMLError as error:
        raise UserError(f"{path}: not a yaml file: {' '.join(str(error).split())}") from error
    except msgspec.ValidationError as error:
        raise UserError(f"{path}: not a graph of cameras: {error}") from error


def _node(path: Path, name: str, value: object) -> Node:
    try:
        place = _Place(msgspec.convert(value, Point)) if isinstance(value, list) else msgspec.convert(value, _Place)
    except msgspec.ValidationError as error:
        raise UserError(f"{path}: node {name}: write [x, y] or {{at: [x, y], camera: false}} ({error})") from error
    with in_file(path):
        require_all("coordinate", f"position of node {name}", place.at)
    return Node(place.at, place.camera)


def _edge(path: Path, names: list[str], number: int, value: object) -> Edge:
    try:
        ends = isinstance(value, list)
        way = _Way(msgspec.convert(value, tuple[str, str])) if ends else msgspec.convert(value, _Way)
    except msgspec.ValidationError as error:
        shape = "write [name, name] or {between: [name, name], via: [[x, y]]}"
        raise UserError(f"{path}: edge {number}: {shape} ({error})") from error
    first, last = (_index(path, names, name, f"edge {number}") for name in way.between)
    with in_file(path):
        require_all("coordinate", f"bends of edge {number}", way.via)
    return Edge((first, last), tuple(way.via))


def _index(path: Path, names: list[str], name: str, where: str) -> int:
    if name not in names:
        raise UserError(f"{path}: {where}: there is no node called {name}")
    return names.index(name)


def _point(point: Point) -> str:
    return f"[{point[0]!r}, {point[1]!r}]"

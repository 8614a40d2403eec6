"""The walk of an exploration as waypoints: a table for people and a GeoJSON route for nav2's route server.

`waypoints.csv`: one line per stop, the start first: number, place, x, y [m], heading of arrival [rad], distance so far
[m], standard deviations of the robot's position (root of the trace) [m] and heading [rad], and of the cameras found so
far (root mean square) [m], covariance of the robot's position xx, xy, yy [m^2]; all as predicted.

`route.geojson`: the graph that nav2_route loads. Its loader knows straight edges alone and ignores the points of a
line, so that the bends of a way are nodes as well. Nodes are Point features with an `id` and a `frame`, places with the
number that they have in the graph and as metadata their name, whether there is a camera, and the standard deviation of
the cameras found until the last visit (root mean square) [m]; edges are MultiLineString features with `id`, `startid`,
`endid`, one for each direction driven. Source: docs.nav2.org, Route Server; navigation2,
nav2_route/src/plugins/graph_file_loaders/geojson_graph_file_loader.cpp.
"""

from __future__ import annotations

import json
import math
from itertools import count, pairwise
from pathlib import Path

from groma.io.atomic import write_text
from groma.io.camera_graph import node_names
from groma.nouns.building import Graph
from groma.planning.exploration import Run, Stop

Point = tuple[float, float]
Numbered = tuple[int, Point]


def write_waypoints(path: Path, graph: Graph, run: Run) -> None:
    """Write the stops of a run as CSV."""
    names = node_names(graph)
    lines = ["stop,place,x,y,heading,distance,robot_sigma,heading_sigma,camera_sigma,robot_xx,robot_xy,robot_yy"]
    for number, stop in enumerate(run.stops):
        x, y = graph.nodes[stop.node].position
        sigma = math.sqrt(max(stop.robot[0] + stop.robot[2], 0.0))
        arrival = arrival_heading(graph, run, number)
        values = (x, y, arrival, stop.length, sigma, stop.heading, stop.sigma, *stop.robot)
        lines.append(f"{number},{_quoted(names[stop.node])}," + ",".join(f"{value:.6g}" for value in values))
    write_text(path, "\n".join(lines) + "\n")


def write_route(path: Path, graph: Graph, run: Run) -> None:
    """Write the ways driven as the GeoJSON graph of nav2_route."""
    names, last = node_names(graph), {stop.node: stop for stop in run.stops}
    driven = {(run.stops[i - 1].node, stop.node, stop.edge or 0) for i, stop in enumerate(run.stops) if i}
    nodes = [
        _node(node, graph.nodes[node].position, _metadata(graph, names, stop)) for node, stop in sorted(last.items())
    ]
    bends, lines = _bends(graph, {edge for _, _, edge in driven}), []
    for start, end, edge in sorted(driven):
        inner = bends[edge] if graph.edges[edge].ends[0] == start else bends[edge][::-1]
        lines += list(pairwise([(start, graph.nodes[start].position), *inner, (end, graph.nodes[end].position)]))
    nodes += [_node(number, at, {}) for way in bends.values() for number, at in way]
    first = len(graph.nodes) + sum(map(len, bends.values()))
    edges = [_edge(first + i, *line) for i, line in enumerate(lines)]
    content = {"type": "FeatureCollection", "name": "groma", "features": nodes + edges}
    write_text(path, json.dumps(content, indent=1) + "\n")


def _bends(graph: Graph, driven: set[int]) -> dict[int, list[Numbered]]:
    """Return the bends of the ways driven, from the first end to the second, numbered after the places."""
    number = count(len(graph.nodes))
    return {edge: [(next(number), bend) for bend in graph.edges[edge].via] for edge in sorted(driven)}


def _metadata(graph: Graph, names: tuple[str, ...], stop: Stop) -> dict[str, object]:
    return {"name": names[stop.node], "camera": graph.nodes[stop.node].camera, "sigma": round(stop.sigma, 6)}


def _node(number: int, at: Point, metadata: dict[str, object]) -> dict[str, object]:
    properties = {"id": number, "frame": "map"} | ({"metadata": metadata} if metadata else {})
    return {"type": "Feature", "properties": properties, "geometry": {"type": "Point", "coordinates": list(at)}}


def _edge(number: int, start: Numbered, end: Numbered) -> dict[str, object]:
    properties = {"id": number, "startid": start[0], "endid": end[0]}
    geometry = {"type": "MultiLineString", "coordinates": [[list(start[1]), list(end[1])]]}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def points(graph: Graph, edge: int, start: int) -> list[Point]:
    """Return the points of a way, driven from one of its ends."""
    way = graph.edges[edge]
    line = [graph.nodes[way.ends[0]].position, *way.via, graph.nodes[way.ends[1]].position]
    return line if way.ends[0] == start else line[::-1]


def arrival_heading(graph: Graph, run: Run, number: int) -> float:
    """Return the heading with which the robot comes to a stop [rad]; at the start, that of its first way."""
    if len(run.stops) < 2:
        return 0.0
    stop = run.stops[max(number, 1)]
    line = points(graph, stop.edge or 0, run.stops[max(number, 1) - 1].node)
    (ax, ay), (bx, by) = line[-2:] if number else line[:2]
    return math.atan2(by - ay, bx - ax)


def _quoted(name: str) -> str:
    plain = not any(mark in name for mark in ',"\n')
    return name if plain else '"' + name.replace('"', '""') + '"'

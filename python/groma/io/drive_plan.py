"""The walk of an exploration as waypoints: a table for people and a GeoJSON route for nav2's route server.

`waypoints.csv`: one line a stop, the start first: number, place, x, y [m], heading of arrival [rad], distance so far
[m], standard deviations of the robot's position (root of the trace) [m] and heading [rad], and of the cameras found so
far (root mean square) [m].

`route.geojson`: the graph that nav2_route loads: nodes are Point features with an `id` and a `frame`, edges
MultiLineString features with `id`, `startid`, `endid`, one for each direction driven. The standard deviation after the
last visit is metadata of a node. Source: docs.nav2.org, Route Server, graph file.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

from groma.exploration import Graph, Run
from groma.io.atomic import write_text
from groma.io.camera_graph import node_names

Point = tuple[float, float]


def write_waypoints(path: Path, graph: Graph, run: Run) -> None:
    """Write the stops of a run as CSV."""
    names = node_names(graph)
    lines = ["stop,place,x,y,heading,distance,robot_sigma,heading_sigma,camera_sigma"]
    for number, stop in enumerate(run.stops):
        x, y = graph.nodes[stop.node].position
        sigma = math.sqrt(max(stop.robot[0] + stop.robot[2], 0.0))
        arrival = arrival_heading(graph, run, number)
        values = (x, y, arrival, stop.length, sigma, stop.heading, stop.sigma)
        lines.append(f"{number},{_quoted(names[stop.node])}," + ",".join(f"{value:.6g}" for value in values))
    write_text(path, "\n".join(lines) + "\n")


def write_route(path: Path, graph: Graph, run: Run) -> None:
    """Write the ways driven as the GeoJSON graph of nav2_route."""
    names, last = node_names(graph), {stop.node: stop for stop in run.stops}
    features = [
        {
            "type": "Feature",
            "properties": {
                "id": node,
                "frame": "map",
                "metadata": {"name": names[node], "camera": graph.nodes[node].camera, "sigma": round(stop.sigma, 6)},
            },
            "geometry": {"type": "Point", "coordinates": list(graph.nodes[node].position)},
        }
        for node, stop in sorted(last.items())
    ]
    driven = {(run.stops[i - 1].node, stop.node, stop.edge) for i, stop in enumerate(run.stops) if i}
    for number, (start, end, edge) in enumerate(sorted(driven, key=lambda way: (way[0], way[1], way[2] or 0))):
        line = [list(point) for point in points(graph, edge or 0, start)]
        properties = {"id": len(graph.nodes) + number, "startid": start, "endid": end}
        geometry = {"type": "MultiLineString", "coordinates": [line]}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})
    content = {"type": "FeatureCollection", "name": "groma", "features": features}
    write_text(path, json.dumps(content, indent=1) + "\n")


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

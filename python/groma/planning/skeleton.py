"""The ways of a building from its occupancy map: the middle lines of the free space, as a graph.

Free cells further than CLEARANCE from anything else, at a cell of at least CELL, are thinned to lines one cell wide
(`groma.planning.thinning`). Rooms of ROOM and more that such cells do not join, but cells further than NARROW do, are
joined by the middle lines of these: doors are as narrow as robots allow. Cells of the lines with one neighbour or more
than two become places, those that touch one place together; the lines between them ways with a bend where the line
leaves the chord by more than STRAIGHT (Ramer 1972; Douglas and Peucker 1973). Dead ends shorter than SPUR are dropped:
they come from the raggedness of walls. Places where two ways meet are joined into one way. Every place left bears a
camera: edit the file to say where there is none. The start is the place nearest to the origin of the map; what cannot
be reached from it is left out.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np

from groma.errors import UserError
from groma.io.nav2_map import read_map
from groma.nouns.building import Edge, Graph, Node
from groma.nouns.findings import Finding
from groma.planning.thinning import AROUND, Cell, Mask, joined, shrunk, thinned

Line = list[Cell]

CELL, CLEARANCE, NARROW, SPUR, STRAIGHT = 0.1, 0.35, 0.15, 1.5, 0.25
"""[m]"""
ROOM = 2.0
"""[m^2]"""


def graph_of_map(path: Path) -> tuple[Graph, tuple[Finding, ...]]:
    """Return the ways of a nav2 map, and what was assumed and left out.

    Raises
    ------
    UserError
        When the map cannot be read or has no two places with a way between.
    """
    grid = read_map(path)
    factor = max(1, round(CELL / grid.resolution))
    free = _coarse(grid.cells == 0, factor)
    cell = grid.resolution * factor
    wide, narrow = (shrunk(free, math.ceil(reach / cell)) for reach in (CLEARANCE, NARROW))
    lines = _without_spurs(_traced(thinned(joined(wide, narrow, ROOM / cell**2))), SPUR / cell)
    if not lines:
        raise UserError(f"{path}: no way of {SPUR} m was found in its free space: draw the graph by hand")
    whole = _graph(lines, cell, grid.origin)
    graph = _connected(whole)
    text = f"every one of the {len(graph.nodes)} places bears a camera: say in graph.yaml where there is none"
    assumed = Finding("assumption", text)
    lost = len(whole.nodes) - len(graph.nodes)
    if not lost:
        return graph, (assumed,)
    text = f"{lost} places cannot be reached from the start with {NARROW} m on either side, and are left out"
    return graph, (assumed, Finding("places-unreachable", text, values={"count": (lost, "1")}))


def _coarse(free: Mask, factor: int) -> Mask:
    """Return blocks of cells, free when most of their cells are."""
    height, width = (size // factor * factor for size in free.shape)
    blocks = free[:height, :width].reshape(height // factor, factor, width // factor, factor)
    shares: Mask = blocks.mean(axis=(1, 3)) > 0.5
    return shares


def _traced(thin: Mask) -> list[Line]:
    """Return the lines between the places, places included at both ends as the middles of their cells."""
    cells = {(int(r), int(c)) for r, c in np.argwhere(thin)}
    around = {cell: [n for d in AROUND if (n := (cell[0] + d[0], cell[1] + d[1])) in cells] for cell in cells}
    knots = {cell for cell, near in around.items() if len(near) != 2}
    place = _clusters(knots, around)
    lines, used = [], set()
    for knot in sorted(knots):
        for first in around[knot]:
            if first in knots or (knot, first) in used:
                continue
            line = [knot, first]
            while line[-1] not in knots:
                onward = [n for n in around[line[-1]] if n != line[-2]]
                ends = [n for n in onward if n in knots]
                line.append((ends or onward)[0])
            used |= {(line[0], line[1]), (line[-1], line[-2])}
            lines.append([place[line[0]], *line[1:-1], place[line[-1]]])
    return [line for line in lines if line[0] != line[-1]]


def _clusters(knots: set[Cell], around: dict[Cell, list[Cell]]) -> dict[Cell, Cell]:
    """Return for every cell of a place the one that represents the place."""
    place: dict[Cell, Cell] = {}
    for knot in sorted(knots):
        if knot in place:
            continue
        group, queue = [], [knot]
        while queue:
            cell = queue.pop()
            if cell not in place:
                place[cell] = knot
                group.append(cell)
                queue += [n for n in around[cell] if n in knots]
        middle = np.mean(group, axis=0)
        nearest = min(group, key=lambda cell: math.dist(cell, middle))
        place |= dict.fromkeys(group, nearest)
    return place


def _without_spurs(lines: list[Line], least: float) -> list[Line]:
    """Drop short dead ends, the shortest first, and join lines that then only follow each other."""
    while True:
        lines = _in_one(lines)
        degree = _degrees(lines)
        spurs = [line for line in lines if _length(line) < least and 1 in (degree[line[0]], degree[line[-1]])]
        if not spurs or len(lines) == 1:
            return [line for line in lines if _length(line) >= least] if len(lines) == 1 else lines
        lines.remove(min(spurs, key=_length))


def _in_one(lines: list[Line]) -> list[Line]:
    """Join lines that only follow each other, but none to a loop: a way has two ends."""
    lines = list(lines)
    while pair := _following(lines):
        a, b = pair
        (end,) = {a[0], a[-1]} & {b[0], b[-1]}
        head = a if a[-1] == end else a[::-1]
        tail = b if b[0] == end else b[::-1]
        lines = [line for line in lines if line is not a and line is not b] + [[*head, *tail[1:]]]
    return lines


def _following(lines: list[Line]) -> tuple[Line, Line] | None:
    """Return two lines that meet in one place where no other line ends."""
    degree = _degrees(lines)
    for i, a in enumerate(lines):
        for b in lines[i + 1 :]:
            common = {a[0], a[-1]} & {b[0], b[-1]}
            if len(common) == 1 and degree[min(common)] == 2:
                return a, b
    return None


def _degrees(lines: list[Line]) -> dict[Cell, int]:
    degree: dict[Cell, int] = {}
    for line in lines:
        for end in (line[0], line[-1]):
            degree[end] = degree.get(end, 0) + 1
    return degree


def _length(line: Line) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(line))


def _graph(lines: list[Line], cell: float, origin: tuple[float, float]) -> Graph:
    places = sorted({end for line in lines for end in (line[0], line[-1])})
    number = {place: i for i, place in enumerate(places)}

    def metres(spot: Cell) -> tuple[float, float]:
        return (round(origin[0] + (spot[1] + 0.5) * cell, 3), round(origin[1] + (spot[0] + 0.5) * cell, 3))

    edges = [
        Edge((number[line[0]], number[line[-1]]), tuple(metres(spot) for spot in _bends(line, STRAIGHT / cell)))
        for line in lines
    ]
    nodes = tuple(Node(metres(place)) for place in places)
    start = min(range(len(nodes)), key=lambda i: math.hypot(*nodes[i].position))
    return Graph(nodes, tuple(edges), start)


def _bends(line: Line, tolerance: float) -> Line:
    """Return the inner points that a line needs to stay within the tolerance of its chords."""
    if len(line) < 3:
        return []
    a, b = np.array(line[0], float), np.array(line[-1], float)
    d, inner = b - a, np.array(line[1:-1], float) - a
    reach = float(np.hypot(*d))
    away = np.abs(d[0] * inner[:, 1] - d[1] * inner[:, 0]) / reach if reach else np.hypot(*inner.T)
    worst = int(away.argmax()) + 1
    if away[worst - 1] <= tolerance:
        return []
    return [*_bends(line[: worst + 1], tolerance), line[worst], *_bends(line[worst:], tolerance)]


def _connected(graph: Graph) -> Graph:
    """Return the part that can be reached from the start."""
    seen, queue = {graph.start}, [graph.start]
    while queue:
        at = queue.pop()
        onward = {b for edge in graph.edges for a, b in (edge.ends, edge.ends[::-1]) if a == at} - seen
        seen |= onward
        queue += sorted(onward)
    kept = sorted(seen)
    number = {node: i for i, node in enumerate(kept)}
    edges = tuple(Edge((number[e.ends[0]], number[e.ends[1]]), e.via) for e in graph.edges if e.ends[0] in seen)
    return Graph(tuple(graph.nodes[i] for i in kept), edges, number[graph.start])

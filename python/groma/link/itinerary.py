"""Where to drive next through a building while a survey runs: from camera to camera, by who sees the robot.

The building is drawn (docs/reference/camera_graph.md), its places bearing the names of their cameras. The robot is led
by `groma.planning.explorer.Explorer`: what a place looks like comes from the drawing, on arrival. A stop brings the
robot to the place it was sent to when the camera there sees it. When neither that camera nor the one it comes from does
by the end of the stop, but others do, it has gone to the nearest of these by the shortest way, and plans anew. Places
without a camera are passed without a word.

The covariances are those of the default noise of planning, not of what is measured.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from itertools import pairwise

from groma.errors import UserError
from groma.io.camera_protocol import Detections, Numbered, Stop
from groma.nouns.building import Graph
from groma.planning.exploration import Settings
from groma.planning.explorer import Explorer, Place

Point = tuple[float, float]
End = tuple[int, int]
"""A way and one of its ends."""


@dataclass(frozen=True, slots=True)
class Leg:
    """A drive from a camera to the next, or the end of all drives."""

    start: str
    to: str | None
    """None when nothing is left to do."""
    line: tuple[Point, ...]
    """From the start over bends and junctions to the end [m]."""
    sigma: float
    """Standard deviation of the cameras found so far, root mean square [m]."""

    @property
    def length(self) -> float:
        """Its length [m]."""
        return sum(math.dist(a, b) for a, b in pairwise(self.line))

    def __str__(self) -> str:
        """Return the leg as a line for the driver."""
        if self.to is None:
            return f"{self.start}: nothing is left to drive, the cameras are placed to {self.sigma:.2f} m"
        way = ", ".join(f"({x:.1f}, {y:.1f})" for x, y in self.line[1:])
        return f"{self.start}: next drive {self.length:.0f} m to {self.to}, by {way}"


class Itinerary:
    """Lead a robot from camera to camera.

    Parameters
    ----------
    graph
        The building; it starts wherever a camera sees the robot first.
    cameras
        Names of the cameras that there are; other places are taken to have none.
    settings
        How to explore.

    Raises
    ------
    UserError
        When no place bears the name of a camera.
    """

    def __init__(self, graph: Graph, cameras: Collection[str], settings: Settings | None = None) -> None:
        self._graph, self._settings = graph, settings or Settings()
        self._node = {name: i for i, name in enumerate(graph.names) if name in cameras}
        if not self._node:
            raise UserError("no place of the building bears the name of a camera: name the places so")
        self._robot: Explorer | None = None
        self._here = self._left = 0
        """Where the explorer is, and the camera that the robot was last at."""
        self._leg: list[tuple[int, End]] = []
        """The last way of the leg, if it ends at a camera: the exit and the way."""
        self._stop: tuple[str | None, int] | None = None
        self._seen: set[int] = set()
        self._arrived = False
        self.leg: Leg | None = None
        """The last one told, which holds until the next."""

    def take(self, message: Numbered) -> Leg | None:
        """Take a new message of the survey; return where to drive when the robot has come to a camera."""
        if isinstance(message, Detections) and message.survey is not None and message.panels:
            return self._saw(message.sender, (message.survey, message.stop))
        if isinstance(message, Stop) and not message.standing:
            return self._goes_on()
        return None

    def blocked(self) -> Leg | None:
        """Take note that there was no getting through on the leg, and that the robot is back; return another."""
        if self._robot is None or not self._leg:
            return None
        self._robot.blocked(self._leg[0][0])
        return self._next(self._robot)

    def _saw(self, name: str, stop: tuple[str, int]) -> Leg | None:
        if stop != self._stop:
            self._stop, self._seen, self._arrived = stop, set(), False
        node = self._node.get(name)
        if node is None or self._arrived:
            return None
        self._seen.add(node)
        if self._robot is None:
            place = self._place(node, sees=True)
            self._robot = Explorer(place, len(self._node), self._settings, (*place.exits, 0.0)[0])
            self._here = node
        elif self._leg and node == self._end(self._leg[0][1]):
            self._arrive(self._robot, *self._leg[0], sees=True)
        else:
            return None
        return self._next(self._robot)

    def _goes_on(self) -> Leg | None:
        """Find out where the robot was if it was not where it was sent."""
        robot, seen = self._robot, self._seen
        self._seen = set()
        if robot is None or self._arrived or self._left in seen:
            return None
        ways = [way for node in sorted(seen) if (way := self._shortest(node))]
        if not ways:
            return None
        way = min(ways, key=lambda way: sum(map(self._length, way)))
        for end in way:
            self._arrive(robot, self._ends(self._here).index(end), end, sees=end is way[-1])
        return self._next(robot)

    def _next(self, robot: Explorer) -> Leg:
        """Ask for the next leg, through junctions, to a camera."""
        self._arrived, self._left, self._leg = True, self._here, []
        line: list[Point] = [self._graph.nodes[self._here].position]
        while (exit_ := robot.next()) is not None:
            end = self._ends(self._here)[exit_]
            line += self._line(end)[1:]
            if self._end(end) in self._node.values():
                self._leg = [(exit_, end)]
                return self._told(robot, self._graph.names[self._end(end)], line)
            self._arrive(robot, exit_, end, sees=False)
        return self._told(robot, None, line)

    def _told(self, robot: Explorer, to: str | None, line: list[Point]) -> Leg:
        self.leg = Leg(self._graph.names[self._left], to, tuple(line), robot.sigma)
        return self.leg

    def _arrive(self, robot: Explorer, left: int, end: End, *, sees: bool) -> None:
        node = self._end(end)
        enters = self._ends(node).index((end[0], 1 - end[1]))
        robot.arrived(left, self._place(node, sees=sees), enters, self._line(end)[1:-1])
        self._here = node

    def _place(self, node: int, *, sees: bool) -> Place:
        lines = (self._line(end) for end in self._ends(node))
        exits = tuple(math.atan2(b[1] - a[1], b[0] - a[0]) for a, b, *_ in lines)
        return Place(node, self._graph.nodes[node].position, sees, exits)

    def _ends(self, node: int) -> list[End]:
        """Return the ways out of a place."""
        return [(i, k) for i, edge in enumerate(self._graph.edges) for k in (0, 1) if edge.ends[k] == node]

    def _end(self, end: End) -> int:
        """Return where a way leads."""
        return self._graph.edges[end[0]].ends[1 - end[1]]

    def _line(self, end: End) -> list[Point]:
        edge = self._graph.edges[end[0]]
        line = [self._graph.nodes[edge.ends[0]].position, *edge.via, self._graph.nodes[edge.ends[1]].position]
        return line[::-1] if end[1] else line

    def _length(self, end: End) -> float:
        return sum(math.dist(a, b) for a, b in pairwise(self._line(end)))

    def _shortest(self, to: int) -> list[End]:
        """Return the shortest way from here (Bellman and Ford's method)."""
        best: dict[int, tuple[float, list[End]]] = {self._here: (0.0, [])}
        for _ in self._graph.nodes:
            for node, (length, way) in list(best.items()):
                for end in self._ends(node):
                    longer = length + self._length(end)
                    if longer < best.get(self._end(end), (math.inf, []))[0]:
                        best[self._end(end)] = (longer, [*way, end])
        return best[to][1] if to in best else []

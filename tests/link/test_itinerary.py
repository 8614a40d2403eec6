"""A robot led through a drawn building by who sees it."""

from __future__ import annotations

import pytest

from groma.errors import UserError
from groma.io.camera_protocol import Corners, Detections, Stop
from groma.link.itinerary import Itinerary, Leg
from groma.nouns.building import Edge, Graph, Node
from groma.planning.exploration import Settings, Sigma, explore, scene

PANEL = Corners(panel="front", ids=(0,), u=(1.0,), v=(1.0,), sigma=(0.1,))


class Drive:
    """A robot that stops, is seen, and goes on."""

    def __init__(self, itinerary: Itinerary) -> None:
        self.itinerary, self.stop = itinerary, 0

    def sees(self, *cameras: str) -> Leg | None:
        """Stop where cameras see the robot; return the last leg told until it goes on."""
        told = [self.itinerary.take(self._detections(camera)) for camera in cameras]
        ends = Stop(sender="robot", boot="b", sequence=self.stop, stop=self.stop, stamp=0.0, standing=False)
        told.append(self.itinerary.take(ends))
        self.stop += 1
        return next((leg for leg in reversed(told) if leg), None)

    def _detections(self, camera: str) -> Detections:
        return Detections(
            sender=camera,
            boot="c",
            sequence=self.stop,
            frame=0,
            survey="b",
            stop=self.stop,
            captured=0.0,
            clock_sigma=0.01,
            width=640,
            height=480,
            panels=(PANEL,),
        )


def named(graph: Graph) -> Graph:
    """Return a graph whose places have names."""
    return Graph(graph.nodes, graph.edges, graph.start, tuple(f"c{i}" for i in range(len(graph.nodes))))


def test_a_robot_that_does_as_it_is_told_drives_the_walk_of_the_plan() -> None:
    graph = named(scene("sparse", size=9, seed=2))
    settings = Settings(goal=Sigma(0.15))
    drive, told, length = Drive(Itinerary(graph, graph.names, settings)), ["c0"], 0.0
    leg = drive.sees("c0")
    while leg is not None and leg.to is not None:
        told.append(leg.to)
        length += leg.length
        leg = drive.sees(leg.to)
    plan = explore(graph, settings)
    assert told == [graph.names[stop.node] for stop in plan.stops]
    assert length == pytest.approx(plan.length)
    assert leg is not None
    assert leg.sigma <= 0.15
    assert "nothing is left" in str(leg)


def corridor() -> Graph:
    """Return cameras a, b, c in a row, a junction between b and c, and a room d beside it."""
    at = {"a": (0.0, 0.0), "b": (8.0, 0.0), "j": (16.0, 0.0), "c": (24.0, 0.0), "d": (16.0, 8.0)}
    nodes = tuple(Node(p, name != "j") for name, p in at.items())
    return Graph(nodes, (Edge((0, 1)), Edge((1, 2)), Edge((2, 3)), Edge((2, 4), ((18.0, 4.0),))), 0, tuple(at))


def test_junctions_and_bends_are_passed_without_a_word() -> None:
    drive = Drive(Itinerary(corridor(), {"a", "b", "c", "d"}))
    first, second = drive.sees("a"), drive.sees("b")
    assert first is not None
    assert first.to == "b"
    assert second is not None
    assert second.to in ("c", "d")
    assert (16.0, 0.0) in second.line
    assert second.length >= 16.0


def test_the_camera_that_it_comes_from_does_not_call_it_back() -> None:
    drive = Drive(Itinerary(corridor(), {"a", "b", "c", "d"}))
    assert drive.sees("a") is not None
    assert drive.sees("a") is None
    leg = drive.sees("a", "b", "a")
    assert leg is not None
    assert leg.start == "b"


def test_a_robot_that_went_elsewhere_is_led_on_from_there() -> None:
    drive = Drive(Itinerary(corridor(), {"a", "b", "c", "d"}))
    drive.sees("a")
    leg = drive.sees("c")
    assert leg is not None
    assert leg.start == "c"
    found = {"a", "c"}
    while leg is not None and leg.to is not None:
        found.add(leg.to)
        leg = drive.sees(leg.to)
    assert found == {"a", "b", "c", "d"}


def test_a_way_that_is_shut_is_driven_around() -> None:
    graph = named(scene("ring", size=5))
    drive = Drive(Itinerary(graph, graph.names))
    first = drive.sees("c0")
    assert first is not None
    second = drive.itinerary.blocked()
    assert second is not None
    assert second.start == "c0"
    assert {first.to, second.to} == {"c1", "c4"}


def test_cameras_that_are_not_there_are_not_waited_for() -> None:
    drive = Drive(Itinerary(corridor(), {"a", "b", "d"}))
    drive.sees("a")
    leg = drive.sees("b")
    assert leg is not None
    assert leg.to == "d"


def test_a_building_without_names_is_refused() -> None:
    with pytest.raises(UserError, match="bears the name of a camera"):
        Itinerary(scene("ring", size=5), {"c0"})

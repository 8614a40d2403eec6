"""Exploration from Python and from the command line."""

from __future__ import annotations

import csv
import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from groma.cli import run as command
from groma.cli.demo_plan import PLANS, plan_simulated
from groma.errors import UserError
from groma.evaluation.exploration import band, matched, trade_offs
from groma.io.camera_graph import read_graph, write_graph
from groma.io.nav2_map import write_map
from groma.nouns.building import Graph
from groma.nouns.maps import OccupancyGrid
from groma.planning.exploration import Budget, Lambda, Settings, Sigma, explore, scene, try_walk
from groma.planning.explorer import Explorer, Place
from groma.planning.skeleton import graph_of_map
from groma.planning.thinning import thinned
from groma.runs.run import Run

HAND = """
start: dock
nodes:
  hall: [8, 0]
  dock: [0, 0]
  door: {at: [8, 6], camera: false}
  lab: [14, 6]
edges:
  - [dock, hall]
  - {between: [hall, door], via: [[9, 2], [9, 4]]}
  - [door, lab]
"""


def test_a_survey_of_sparse_buildings_lies_below_the_rules_that_robots_are_given() -> None:
    graphs = [scene("sparse", seed=seed) for seed in range(4)]
    curves = {(p.strategy, p.weight): p for p in trade_offs(graphs, (30.0, 300.0))}
    hasty, careful = curves["survey", 30.0], curves["survey", 300.0]
    for rule in ("depth-first", "nearest"):
        assert hasty.distance < curves[rule, None].distance
        assert hasty.sigma < curves[rule, None].sigma
    assert careful.distance < curves["return-to-nearest", None].distance
    assert careful.sigma < curves["return-to-nearest", None].sigma


def test_a_survey_that_drives_as_far_as_a_rule_is_more_accurate() -> None:
    graphs = [scene("sparse", seed=seed) for seed in range(4)]
    for match in matched(graphs, ("depth-first", "return-to-nearest", "return-to-origin")):
        assert match.survey_distance <= match.distance
        assert match.survey_sigma < match.sigma


def test_what_is_promised_is_what_drawn_noise_gives() -> None:
    graph = scene("ring", size=8, step=6.25)
    run = explore(graph, Settings(goal=Lambda(100.0)))
    tried = try_walk(graph, run.walk, runs=300)
    assert tried.map.sigma == pytest.approx(run.sigma, rel=0.15)
    assert 0.9 < tried.map.nees < 1.1


def test_sigma_and_budget_lead_a_survey() -> None:
    graph = scene("hexagons", size=22)
    assert explore(graph, Settings(goal=Sigma(0.3))).sigma <= 0.3
    assert explore(graph, Settings(goal=Budget(300.0))).length <= 300.0


def test_a_robot_is_led_live() -> None:
    robot = Explorer(Place(7, (0.0, 0.0), True, (0.0, 1.5)), announced=2)
    first = robot.next()
    assert first is not None
    robot.blocked(first)
    second = robot.next()
    assert second == 1 - first
    robot.arrived(second, Place(9, (0.0, 8.0), True, (-1.5,)), enters=0)
    assert (robot.has_found_all, robot.driven) == (True, 8.0)
    with pytest.raises(UserError, match="none numbered 5"):
        robot.blocked(5)


def test_a_graph_by_hand_is_read_and_written_the_same(tmp_path: Path) -> None:
    (tmp_path / "hand.yaml").write_text(HAND)
    graph = read_graph(tmp_path / "hand.yaml")
    assert (graph.start, graph.names[2], graph.nodes[2].camera, graph.edges[1].via[1]) == (1, "door", False, (9, 4))
    write_graph(tmp_path / "again.yaml", graph)
    assert read_graph(tmp_path / "again.yaml") == graph


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[dock, hall]", "[dock, hell]", "edge 0: there is no node called hell"),
        ("hall: [8, 0]", "hall: [8]", "node hall: write"),
        ("hall: [8, 0]", "hall: [.nan, 0]", "position of node hall[0] = nan"),
        ("hall: [8, 0]", "hall: [0, 0]", "without length"),
        ("start: dock", "start: quay", "start: there is no node called quay"),
        ("- [door, lab]", "", "to place 3"),
        ("start: dock", "begin: dock", "begin"),
        ("nodes:", "nodes: [", "not a yaml file"),
    ],
)
def test_a_graph_with_a_mistake_is_refused_with_its_place(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "hand.yaml").write_text(HAND.replace(old, new))
    with pytest.raises(UserError, match=r"hand\.yaml: ") as refused:
        read_graph(tmp_path / "hand.yaml")
    assert said in str(refused.value)


def test_a_plan_is_written_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "hand.yaml").write_text(HAND)
    out = tmp_path / "plan"
    assert (
        command(["plan", "exploration", str(tmp_path / "hand.yaml"), "--lambda", "30", "-o", str(out), "--frames"]) == 0
    )
    assert "locates all 3 cameras" in capsys.readouterr().out
    rows = list(csv.DictReader((out / "waypoints.csv").read_text().splitlines()))
    assert rows[0]["place"] == "dock"
    assert float(rows[1]["distance"]) == 8.0
    route = json.loads((out / "route.geojson").read_text())
    ids = [f["properties"]["id"] for f in route["features"]]
    assert len(ids) == len(set(ids))
    assert {f["geometry"]["type"] for f in route["features"]} == {"Point", "MultiLineString"}
    at = {f["properties"]["id"]: f["geometry"]["coordinates"] for f in route["features"] if "frame" in f["properties"]}
    edges = [f for f in route["features"] if "startid" in f["properties"]]
    assert [9, 2] in at.values(), "a bend is a node: the loader of nav2 knows straight edges alone"
    for f in edges:
        ends = [at[f["properties"][end]] for end in ("startid", "endid")]
        assert f["geometry"]["coordinates"] == [ends]
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["cameras"] == 3
    assert metrics["sigma_tried_m"] == pytest.approx(metrics["sigma_predicted_m"], rel=0.3)
    assert (out / "walk.gif").read_bytes().startswith(b"GIF89a")
    assert "<svg" in (out / "report.html").read_text()


def test_a_plan_on_a_map_is_drawn_on_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cells = np.full((60, 220), 100, np.int8)
    cells[20:40, 10:210] = cells[5:55, 100:120] = 0
    write_map(tmp_path / "map.yaml", OccupancyGrid(0.1, (-1.0, -3.0), cells))
    assert command(["plan", "exploration", str(tmp_path / "map.yaml"), "-o", str(tmp_path / "plan")]) == 0
    assert "bears a camera: say in graph.yaml" in capsys.readouterr().err
    assert "<image" in (tmp_path / "plan" / "report.html").read_text()
    line = ["evaluate", "exploration", str(tmp_path / "map.yaml"), "--lambdas", "10", "-o", str(tmp_path / "curves")]
    assert command(line) == 0
    assert command(["plan", "exploration", str(tmp_path / "plan" / "graph.yaml"), "-o", str(tmp_path / "again")]) == 0


def test_the_same_request_gives_the_same_bytes(tmp_path: Path) -> None:
    line = ["plan", "exploration", "--scene", "ring", "--size", "6", "--budget", "80", "-o"]
    assert command([*line, str(tmp_path / "a")]) == 0
    assert command([*line, str(tmp_path / "b")]) == 0
    for name in ("waypoints.csv", "route.geojson", "graph.yaml", "metrics.json", "run.toml", "report.html"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ([], 2, "give either a file or --scene"),
        (["none.yaml"], 2, "none.yaml"),
        (["--scene", "ring", "--size", "1"], 2, "size = 1"),
        (["--scene", "ring", "--size", "-1"], 2, "size = -1"),
        (["--scene", "ring", "--lambda", "1", "--sigma", "1"], 2, "--lambda and --sigma"),
        (["--scene", "ring", "--sigma", "nan"], 2, "sigma"),
        (["--scene", "ring", "--sigma", "1", "--strategy", "nearest"], 2, "only the strategy survey"),
        (["--scene", "corridor", "--size", "5", "--sigma", "1e-6"], 1, "cannot be reached"),
        (["--scene", "corridor", "--size", "5", "--budget", "10"], 1, "more than the budget"),
    ],
)
def test_an_impossible_request_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, said: str
) -> None:
    assert command(["plan", "exploration", *arguments, "-o", str(tmp_path / "out")]) == code
    assert said in capsys.readouterr().err


def test_a_comparison_is_written_whole(tmp_path: Path) -> None:
    out = tmp_path / "curves"
    line = ["evaluate", "exploration", "--buildings", "3", "--size", "6", "--lambdas", "10", "--lambdas", "100"]
    assert command([*line, "-o", str(out)]) == 0
    rows = list(csv.DictReader((out / "curves.csv").read_text().splitlines()))
    assert len(rows) == 4 + 3 * 2
    assert all(float(row["sigma"]) > 0 for row in rows)
    assert "survey" in (out / "report.html").read_text()
    matches = list(csv.DictReader((out / "matched.csv").read_text().splitlines()))
    assert [row["rule"] for row in matches] == ["depth-first", "nearest", "return-to-origin", "return-to-nearest"]
    assert all(float(row["survey_distance"]) <= float(row["distance"]) for row in matches)


def test_the_demonstration_writes_a_plan_and_a_comparison(tmp_path: Path) -> None:
    with Run("evaluation", "demo", tmp_path / "demo", command="") as run:
        _, told = plan_simulated(run, tmp_path, 1)
        run.finish({})
    assert "locates all 16 cameras" in told[0]
    assert all((tmp_path / "demo" / page).is_file() for page in PLANS)


def test_the_band_is_students() -> None:
    values = np.array([1.0, 2.0, 4.0])
    assert band(values) == pytest.approx(4.303 * values.std(ddof=1) / math.sqrt(3))
    assert math.isnan(band(values[:1]))


def test_the_ways_of_a_map_are_its_corridors(tmp_path: Path) -> None:
    # A corridor of 2 m around a block of 8 m by 4 m, and a dead end of 5 m.
    cells = np.full((120, 220), 100, np.int8)
    cells[10:90, 10:130] = 0
    cells[30:70, 30:110] = 100
    cells[40:60, 130:190] = 0
    write_map(tmp_path / "map.yaml", OccupancyGrid(0.1, (-1.0, -1.0), cells))
    graph, notes = graph_of_map(tmp_path / "map.yaml")
    assert [note.text for note in notes] == [
        "every one of the 3 places bears a camera: say in graph.yaml where there is none"
    ]
    lengths = sorted(_length(graph, edge) for edge in range(len(graph.edges)))
    assert len(graph.nodes) == 3, "the fork, the dead end, and one on the ring, which is no way from a place to itself"
    assert lengths[0] == pytest.approx(5.8, abs=0.6)
    assert sum(lengths[1:]) == pytest.approx(2 * (10 + 6), abs=2.5)


def test_rooms_are_joined_through_a_door_as_wide_as_a_robot(tmp_path: Path) -> None:
    # Two rooms of 6 m by 6 m, a door of 0.6 m between, and two corridors that cross and lead nowhere.
    cells = np.full((80, 220), 100, np.int8)
    cells[10:70, 10:70] = cells[10:70, 75:135] = cells[32:48, 150:210] = cells[10:70, 172:188] = 0
    cells[38:44, 70:75] = 0
    write_map(tmp_path / "map.yaml", OccupancyGrid(0.1, (-1.0, -1.0), cells))
    graph, notes = graph_of_map(tmp_path / "map.yaml")
    assert {x > 6.5 for x, _ in (node.position for node in graph.nodes)} == {False, True}
    assert max(x for x, _ in (node.position for node in graph.nodes)) < 13.0
    assert "cannot be reached" in notes[1].text


def test_thinning_leaves_one_line_of_a_bar() -> None:
    bar = np.zeros((9, 40), np.bool_)
    bar[2:7, 3:37] = True
    thin = thinned(bar)
    assert (thin.sum(axis=0)[6:34] == 1).all()


def _length(graph: Graph, edge: int) -> float:
    way = graph.edges[edge]
    line = [graph.nodes[way.ends[0]].position, *way.via, graph.nodes[way.ends[1]].position]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(line))

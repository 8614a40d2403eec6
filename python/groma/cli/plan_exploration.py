"""`groma plan exploration`: which way to drive through a building whose cameras are to be mapped."""

from __future__ import annotations

import json
import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from groma.errors import EstimationError, UserError
from groma.exploration import (
    Budget,
    Goal,
    Graph,
    Lambda,
    Run,
    SceneName,
    Settings,
    Sigma,
    StrategyName,
    Tried,
    explore,
    try_walk,
)
from groma.exploration import (
    scene as draw,
)
from groma.io.atomic import write_bytes, write_text
from groma.io.building import Building, read_building
from groma.io.camera_graph import write_graph
from groma.io.drive_plan import write_route, write_waypoints
from groma.io.results import point_latest, result_directory, run_record, shown_command
from groma.io.toml import to_toml
from groma.mapping import OccupancyGrid
from groma.report.exploration_pictures import animation
from groma.report.exploration_report import plan_report, verdict

TRIES = 200
"""Drives with drawn noise that a prediction is checked by."""


def exploration(
    graph: Path | None = None,
    /,
    *,
    scene: SceneName | None = None,
    size: int = 16,
    step: float = 8.0,
    density: float = 0.7,
    seed: int = 0,
    lambda_: Annotated[float | None, Parameter(name="--lambda")] = None,
    sigma: float | None = None,
    budget: float | None = None,
    strategy: StrategyName = "survey",
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    frames: bool = False,
) -> None:
    """Plan the drive that finds and places the cameras of a building: distance against accuracy.

    groma plan exploration --scene hexagons --size 22 --sigma 0.25

    The robot of the plan discovers the building as it drives. The plan is checked by drives with drawn noise.

    Parameters
    ----------
    graph
        The building, a yaml file of places and ways (docs/reference/camera_graph.md), or the yaml file of a nav2 map.
    scene
        An idealised building instead.
    size
        Of the scene: number of cameras.
    step
        Of the scene: length of a way [m].
    density
        Of the scene sparse: share of the ways beyond a tree.
    seed
        Draws the scene and the noise.
    lambda_
        Metres that one square metre less of summed variance is worth [1/m].
    sigma
        Instead: standard deviation of the cameras to reach [m].
    budget
        Instead: distance to spend [m].
    strategy
        How to choose where to go on.
    output
        Folder for the results; a new one in results/ when left out.
    frames
        Also write walk.gif, the drive as an animation.
    """
    goal = _goal(lambda_, sigma, budget)
    building = _building(graph, scene, size=size, step=step, density=density, seed=seed)
    settings = Settings(strategy=strategy) if goal is None else Settings(strategy=strategy, goal=goal)
    directory = result_directory(output, datetime.now().astimezone())
    for note in building.notes:
        print(f"note: {note}", file=sys.stderr)
    run, tried = _planned(building.graph, settings, seed)
    given = {"scene": scene, "size": size, "step": step, "density": density, "seed": seed} if scene else {"seed": seed}
    record = run_record({"exploration": settings.table() | given}, graph, shown_command(sys.argv[1:]))
    save(directory, building.graph, run, tried, record, frames=frames, grid=building.grid)
    if output is None:
        point_latest(directory)
    print(verdict(building.graph, run, tried))
    print(f"{directory / 'report.html'}")
    _complain(goal, run, sum(node.camera for node in building.graph.nodes))


def plan_into(directory: Path, building: Graph, settings: Settings, given: dict[str, object], *, frames: bool) -> str:
    """Plan, try the plan out, write all files into a folder that exists; returns the verdict."""
    run = explore(building, settings)
    tried = try_walk(building, run.walk, noise=settings.noise, runs=TRIES)
    record = run_record({"exploration": settings.table() | given}, None, None)
    save(directory, building, run, tried, record, frames=frames)
    return verdict(building, run, tried)


def save(
    directory: Path,
    building: Graph,
    run: Run,
    tried: Tried | None,
    record: dict[str, object],
    *,
    frames: bool,
    grid: OccupancyGrid | None = None,
) -> None:
    """Write all files of a plan, the report last; the map, if the building comes from one, is drawn under the walk."""
    gif = animation(building, run, grid) if frames else None
    write_graph(directory / "graph.yaml", building)
    write_waypoints(directory / "waypoints.csv", building, run)
    write_route(directory / "route.geojson", building, run)
    if gif:
        write_bytes(directory / "walk.gif", gif)
    write_text(directory / "metrics.json", json.dumps(_figures(run, tried), indent=1, sort_keys=True) + "\n")
    write_text(directory / "run.toml", to_toml(record))
    write_text(directory / "report.html", plan_report(building, run, tried, record, gif, grid))


def _goal(lambda_: float | None, sigma: float | None, budget: float | None) -> Goal | None:
    kinds = (("--lambda", Lambda, lambda_), ("--sigma", Sigma, sigma), ("--budget", Budget, budget))
    given = [(name, kind(value)) for name, kind, value in kinds if value is not None]
    if len(given) > 1:
        raise UserError(f"{given[0][0]} and {given[1][0]}: give one of them")
    return given[0][1] if given else None


def _building(path: Path | None, scene: SceneName | None, **values: float) -> Building:
    if path is not None and scene is None:
        return read_building(path)
    if path is None and scene is not None:
        size, seed = int(values["size"]), int(values["seed"])
        return Building(draw(scene, size=size, step=values["step"], density=values["density"], seed=seed))
    raise UserError("give either a file or --scene: groma plan exploration building.yaml")


def _planned(building: Graph, settings: Settings, seed: int) -> tuple[Run, Tried]:
    """Explore and try the plan out, with progress on a terminal."""
    console, cameras = Console(stderr=True), sum(node.camera for node in building.nodes)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("explore", total=cameras)

        def found(distance: float, count: int) -> None:
            progress.update(task, description=f"{distance:.0f} m, {count} of {cameras} cameras", completed=count)

        def tried(done: int, runs: int) -> None:
            progress.update(task, description=f"drive {done + 1} of {runs} with noise", completed=done, total=runs)

        run = explore(building, settings, found)
        return run, try_walk(building, run.walk, noise=settings.noise, runs=TRIES, seed=seed, progress=tried)


def _figures(run: Run, tried: Tried | None) -> dict[str, object]:
    found = [stop.length for stop in run.stops if stop.complete]
    return {
        "cameras": len(run.cameras),
        "distance_m": _stable(run.length),
        "distance_until_all_found_m": _stable(found[0]) if found else None,
        "sigma_predicted_m": _stable(run.sigma),
        "sigma_tried_m": _stable(tried.map.sigma) if tried else None,
        "nees_per_dof": _stable(tried.map.nees) if tried else None,
        "filter_sigma_tried_m": _stable(tried.filter.sigma) if tried else None,
        "filter_nees_per_dof": _stable(tried.filter.nees) if tried else None,
        "tries": tried.runs if tried else 0,
        "decisions": len(run.decisions),
        "largest_gap": _stable(max((decision.gap for decision in run.decisions), default=0.0)),
    }


def _stable(value: float) -> float:
    return float(f"{value:.9g}")


def _complain(goal: Goal | None, run: Run, cameras: int) -> None:
    """Say when the goal was not reached."""
    if len(run.cameras) < cameras:
        raise EstimationError("not all cameras can be found")
    if isinstance(goal, Sigma) and run.sigma > goal.value:
        raise EstimationError(f"sigma {goal.value} m cannot be reached: no walk lowers {run.sigma:.3g} m any further")
    if isinstance(goal, Budget) and run.length > goal.value:
        raise EstimationError(f"finding all cameras alone takes {run.length:.0f} m, more than the budget")

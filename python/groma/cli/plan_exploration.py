"""`groma plan exploration`: which way to drive through a building whose cameras are to be mapped."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.planning.building import Building, read_building
from groma.planning.exploration import Budget, Goal, Lambda, SceneName, Sigma, StrategyName
from groma.planning.exploration import scene as draw
from groma.runs.exploration import plan_into
from groma.runs.run import Run
from groma.runs.settings import chosen
from groma.runs.tables import RECORDED, exploration_of, goal_table, tables


def exploration(
    graph: Path | None = None,
    /,
    *,
    scene: SceneName | None = None,
    size: int = 16,
    step: float = 8.0,
    density: float = 0.7,
    seed: int | None = None,
    lambda_: Annotated[float | None, Parameter(name="--lambda")] = None,
    sigma: float | None = None,
    budget: float | None = None,
    strategy: StrategyName | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    frames: bool = False,
    config: Path | None = None,
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
        Draws the scene and the noise; 0 when left out.
    lambda_
        Metres of driving traded for one square metre less of summed variance [1/m].
    sigma
        Instead: standard deviation of the cameras to reach [m].
    budget
        Instead: distance to spend [m].
    strategy
        How to choose where to go on; survey when left out.
    output
        Folder for the results; a new one in results/ when left out.
    frames
        Also write walk.gif, the drive as an animation.
    config
        TOML with a table [exploration] (groma config prints it) or the run.toml of another run.
    """
    goal = _goal(lambda_, sigma, budget)
    options = {"strategy": strategy, "seed": seed, "goal": None if goal is None else goal_table(goal)}
    defaults = tables()["exploration"]() | {"goal": None}
    chosen_ = chosen(defaults, config, "exploration", options, RECORDED["exploration"])
    settings, drawn = exploration_of(chosen_), int(str(chosen_["seed"]))
    building = _building(graph, scene, size=size, step=step, density=density, seed=drawn)
    given = {"scene": scene, "size": size, "step": step, "density": density} if scene else {}
    with Run("plan", "plan exploration", output) as run:
        run.inputs["input"] = graph
        plan_into(run, building, settings, {**given, "seed": drawn}, frames=frames)


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

"""`groma evaluate exploration`: what strategies trade, distance against accuracy, over many buildings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.evaluation.exploration import LAMBDAS
from groma.exploration import SceneName
from groma.exploration import scene as draw
from groma.io.building import read_building
from groma.runs.exploration import compare_into
from groma.runs.run import Run


def exploration(
    *graphs: Path,
    scene: SceneName = "sparse",
    size: int = 16,
    step: float = 8.0,
    density: float = 0.7,
    buildings: int = 12,
    lambdas: tuple[float, ...] = LAMBDAS,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Explore buildings by every strategy and draw distance against accuracy, with bands of 95 %.

    groma evaluate exploration --size 9 --buildings 4

    Parameters
    ----------
    graphs
        Buildings as yaml files, also nav2 maps; an idealised scene when left out.
    scene
        Kind of the idealised buildings.
    size
        Their number of cameras.
    step
        Their length of a way [m].
    density
        Of sparse: share of the ways beyond a tree.
    buildings
        How many to draw, with the seeds 0, 1, ...; only sparse ones differ.
    lambdas
        Weights to try.
    output
        Folder for the results; a new one in results/ when left out.
    """
    if buildings < 1:
        raise UserError(f"--buildings {buildings}: must be at least 1")
    if not lambdas:
        raise UserError("--lambdas: give at least one")
    seeds = range(buildings if scene == "sparse" else 1)
    drawn = [read_building(path).graph for path in graphs]
    drawn = drawn or [draw(scene, size=size, step=step, density=density, seed=seed) for seed in seeds]
    given = {"scene": scene, "size": size, "step": step, "density": density}
    with Run("evaluation", "evaluate exploration", output) as run:
        run.inputs |= {path.name: path for path in graphs}
        compare_into(run, drawn, lambdas, given)

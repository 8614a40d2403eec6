"""`groma evaluate exploration`: the trade-off of strategies between distance and accuracy, over many buildings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.evaluation.exploration import Comparison
from groma.planning.building import read_building
from groma.planning.exploration import SceneName
from groma.runs.exploration import compare_into
from groma.runs.run import Run
from groma.runs.tables import settings_of, typed


def exploration(
    *graphs: Path,
    scene: SceneName | None = None,
    size: int | None = None,
    step: float | None = None,
    density: float | None = None,
    buildings: int | None = None,
    lambdas: tuple[float, ...] | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
) -> None:
    """Explore buildings by every strategy and draw distance against accuracy, with bands of 95 %.

    groma evaluate exploration --size 9 --buildings 4

    Parameters
    ----------
    graphs
        Buildings as yaml files, also nav2 maps; an idealised scene when left out.
    scene
        Kind of the idealised buildings; sparse when left out.
    size
        Their number of cameras; 16 when left out.
    step
        Their length of a way [m]; 8 when left out.
    density
        Of sparse: share of the ways beyond a tree; 0.7 when left out.
    buildings
        How many to draw, with the seeds 0, 1, ...; only sparse ones differ. 12 when left out.
    lambdas
        Weights to try; from 3 to 3000 when left out.
    output
        Folder for the results; a new one in results/ when left out.
    config
        TOML with a table [evaluate_exploration] (groma config prints it) or the run.toml of another run.
    """
    options = {"scene": scene, "size": size, "step": step, "density": density, "buildings": buildings}
    settings = settings_of("evaluate_exploration", config, **options, lambdas=lambdas and list(lambdas))
    tried = typed(Comparison, settings, "evaluate_exploration")
    if tried.buildings < 1:
        raise UserError(f"--buildings {tried.buildings}: must be at least 1")
    if not tried.lambdas:
        raise UserError("--lambdas: give at least one")
    drawn = [read_building(path).graph for path in graphs] or tried.scenes()
    with Run("evaluation", "evaluate exploration", output, settings={"evaluate_exploration": settings}) as run:
        run.inputs |= {path.name: path for path in graphs}
        compare_into(run, drawn, tried.lambdas)

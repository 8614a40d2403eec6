"""`groma evaluate exploration`: what strategies trade, distance against accuracy, over many buildings."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.progress import Progress

from groma.errors import UserError
from groma.evaluation.exploration import LAMBDAS, Matched, Traded, matched, trade_offs
from groma.exploration import Graph, SceneName
from groma.exploration import scene as draw
from groma.io.atomic import write_text
from groma.io.building import read_building
from groma.io.results import point_latest, result_directory, run_record, shown_command
from groma.io.toml import to_toml
from groma.report.exploration_report import comparison_report, match_line


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
    directory = result_directory(output, datetime.now().astimezone())
    curves, matches = compared(drawn, lambdas)
    given: dict[str, object] = {"scene": scene, "size": size, "step": step, "density": density}
    record = run_record(
        {"exploration": given | {"buildings": len(drawn), "lambdas": list(lambdas)}}, None, shown_command(sys.argv[1:])
    )
    save(directory, curves, matches, len(drawn), record)
    if output is None:
        point_latest(directory)
    for point in curves:
        weight = "" if point.weight is None else f"lambda {point.weight:g}"
        print(f"{point.strategy:18} {weight:12} {point.distance:7.0f} m  sigma {point.sigma:.3f} m")
    for match in matches:
        print(match_line(match, len(drawn)))
    print(f"{directory / 'report.html'}")


def save(
    directory: Path,
    curves: Sequence[Traded],
    matches: Sequence[Matched],
    buildings: int,
    record: dict[str, object],
) -> None:
    """Write the figures and the report."""
    lines = ["strategy,lambda,distance,distance_band,sigma,sigma_band"]
    for p in curves:
        weight = "" if p.weight is None else f"{p.weight:.9g}"
        values = (p.distance, p.distance_band, p.sigma, p.sigma_band)
        lines.append(f"{p.strategy},{weight}," + ",".join(f"{value:.9g}" for value in values))
    write_text(directory / "curves.csv", "\n".join(lines) + "\n")
    rows = ["rule,distance,survey_distance,sigma,survey_sigma,difference_band,better"]
    for m in matches:
        numbers = (m.distance, m.survey_distance, m.sigma, m.survey_sigma, m.difference_band)
        rows.append(f"{m.rule}," + ",".join(f"{value:.9g}" for value in numbers) + f",{m.better}")
    write_text(directory / "matched.csv", "\n".join(rows) + "\n")
    figures = {"buildings": buildings, "points": len(curves)}
    write_text(directory / "metrics.json", json.dumps(figures, indent=1, sort_keys=True) + "\n")
    write_text(directory / "run.toml", to_toml(record))
    write_text(directory / "report.html", comparison_report(curves, matches, buildings, record))


def compared(graphs: Sequence[Graph], lambdas: Sequence[float]) -> tuple[list[Traded], list[Matched]]:
    """Explore buildings by every strategy, and by the survey as far as each rule went, with progress on a terminal."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("explore", total=None)

        def tell(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        return trade_offs(graphs, lambdas, progress=tell), matched(graphs, progress=tell)

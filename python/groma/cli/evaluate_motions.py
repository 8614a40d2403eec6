"""`groma evaluate motions`: the drives that people use before a camera, tried out."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Annotated

import msgspec
from cyclopts import Parameter
from rich.console import Console
from rich.progress import Progress

from groma.camera import Camera
from groma.camera_plan import DEFAULTS, Stage, Tried, Tries, middle_height, mount
from groma.errors import UserError
from groma.evaluation.motions import Progress as Told
from groma.evaluation.motions import Varied, study, try_motions
from groma.io.atomic import write_text
from groma.io.results import point_latest, result_directory, run_record, shown_command
from groma.io.toml import to_toml
from groma.report.motions_report import motions_report, motions_verdict, shares
from groma.report.words import short


def motions(
    *,
    height: float = 2.0,
    distance: float = 2.6,
    runs: int = DEFAULTS.tries.runs,
    views: int = DEFAULTS.tries.views,
    seed: int = DEFAULTS.tries.seed,
    errors: bool = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Calibrate a camera by the drives that people use, from corners drawn with noise: what scatters, what is refused.

    groma evaluate motions --runs 2 --views 12

    The camera looks at the middle of the drive; the robot carries three panels, 45 degrees apart.

    Parameters
    ----------
    height
        Of the camera above the floor [m].
    distance
        Of the middle of the drives, along the floor [m].
    runs
        Calibrations of each drive.
    views
        Most panels in images that a calibration takes.
    seed
        Draws the noise.
    errors
        Also the error study: number of views, tilt, distance, grid, coverage. Takes minutes.
    output
        Folder for the results; a new one in results/ when left out.
    """
    for name, value, least in (("--runs", runs, 2), ("--views", views, 3), ("--seed", seed, 0)):
        if value < least:
            raise UserError(f"{name} {value}: must be at least {least}")
    tries, stage = Tries(runs, views, seed), _stage(height, distance)
    directory = result_directory(output, datetime.now().astimezone())
    with _progress("drives") as told:
        tried = try_motions(stage, distance, tries, told)
    studied: list[Varied] = []
    if errors:
        with _progress("error study") as told:
            studied = study(tries, told)
    given = {"height": height, "distance": distance, "runs": runs, "views": views, "seed": seed, "errors": errors}
    record = run_record({"motions": given}, None, shown_command(sys.argv[1:]))
    save(directory, stage.camera, tried, studied, runs, record)
    if output is None:
        point_latest(directory)
    for motion, found in tried.items():
        told_ = "  ".join(
            f"{name} {short(share)} %" for name, share in shares(stage.camera, found, found.deviation).items()
        )
        print(f"{motion:13} {told_ or 'refused: ' + (found.reason or '')}")
    print(motions_verdict(tried, runs))
    print(f"{directory / 'report.html'}")


def save(
    directory: Path,
    camera: Camera,
    tried: Mapping[str, Tried],
    studied: Sequence[Varied],
    runs: int,
    record: dict[str, object],
) -> None:
    """Write the figures and the report."""
    figures = {
        "parameters": list(camera.names),
        "motions": {motion: msgspec.to_builtins(found) for motion, found in tried.items()},
        "errors": [{"varied": p.what, "value": p.value, **msgspec.to_builtins(p.found)} for p in studied],
    }
    write_text(directory / "metrics.json", json.dumps(figures, indent=1, sort_keys=True) + "\n")
    write_text(directory / "run.toml", to_toml(record))
    write_text(directory / "report.html", motions_report(camera, tried, studied, runs, record))


def _stage(height: float, distance: float) -> Stage:
    if not (math.isfinite(distance) and distance > 0):
        raise UserError(f"--distance {distance}: must be above 0")
    return Stage(mount(height, math.atan2(height - middle_height(DEFAULTS.target), distance)))


@contextmanager
def _progress(what: str) -> Iterator[Told]:
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)

"""`groma evaluate motions`: common trajectories before a camera, tried out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.planning.camera import DEFAULTS, Stage, Tries, middle_height, mount
from groma.runs.motions import try_motions_into
from groma.runs.run import Run
from groma.runs.settings import Settings
from groma.runs.tables import settings_of


def motions(
    *,
    height: float | None = None,
    distance: float | None = None,
    runs: int | None = None,
    views: int | None = None,
    seed: int | None = None,
    errors: bool = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
) -> None:
    """Calibrate a camera by common trajectories, from corners drawn with noise: what scatters, what is refused.

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
    config
        TOML with a table [motions] (groma config prints it) or the run.toml of another run.
    """
    options = {"height": height, "distance": distance, "runs": runs, "views": views, "seed": seed}
    settings = settings_of("motions", config, **options, errors=errors or None)
    for name, least in (("runs", 2), ("views", 3), ("seed", 0)):
        if _whole(settings, name) < least:
            raise UserError(f"--{name} {settings[name]}: must be at least {least}")
    tries = Tries(*(_whole(settings, name) for name in ("runs", "views", "seed")))
    away = float(str(settings["distance"]))
    stage = _stage(float(str(settings["height"])), away)
    with Run("evaluation", "evaluate motions", output, settings={"motions": settings}) as run:
        try_motions_into(run, stage, away, tries, errors=bool(settings["errors"]))


def _whole(settings: Settings, name: str) -> int:
    return int(str(settings[name]))


def _stage(height: float, distance: float) -> Stage:
    if not (math.isfinite(distance) and distance > 0):
        raise UserError(f"--distance {distance}: must be above 0")
    return Stage(mount(height, math.atan2(height - middle_height(DEFAULTS.target), distance)))

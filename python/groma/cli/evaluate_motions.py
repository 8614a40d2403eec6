"""`groma evaluate motions`: the drives that people use before a camera, tried out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.camera_plan import DEFAULTS, Stage, Tries, middle_height, mount
from groma.errors import UserError
from groma.runs.motions import try_motions_into
from groma.runs.run import Run


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
    given = {"height": height, "distance": distance, "runs": runs, "views": views, "seed": seed, "errors": errors}
    with Run("evaluation", "evaluate motions", output, settings={"motions": given}) as run:
        try_motions_into(run, stage, distance, tries, errors=errors)


def _stage(height: float, distance: float) -> Stage:
    if not (math.isfinite(distance) and distance > 0):
        raise UserError(f"--distance {distance}: must be above 0")
    return Stage(mount(height, math.atan2(height - middle_height(DEFAULTS.target), distance)))

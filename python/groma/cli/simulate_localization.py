"""`groma simulate localization`: a warehouse to map on one day and to find oneself in on others, with the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from groma.errors import UserError
from groma.io.recording import write_recording
from groma.io.reflector_list import write_reflectors
from groma.io.trajectory import write_tum
from groma.io.vehicle_file import write_vehicle
from groma.localization_simulation import (
    Day,
    calibrated_vehicle,
    drive_scenario,
    drives,
    standing_reflectors,
)
from groma.runs.run import Run
from groma.simulation import Scenario, Simulated, simulate


def localization(
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    runs: int = 6,
    reflectors: float = 1.0,
    changed: float = 0.1,
    seed: int = 1,
) -> None:
    """Simulate a survey of a warehouse, four paths of 12, 12, 12 and 7 m, and a round of ten halting points.

    groma simulate localization -o depot

    groma simulate localization -o depot --runs 1 --reflectors 0.25

    Each NAME.mcap has its NAME-truth.tum beside it; vehicle.toml is the calibrated vehicle, reflectors.csv the survey
    of the reflectors.

    Parameters
    ----------
    output
        Folder to write.
    runs
        Drives along each path.
    reflectors
        Share of the reflectors that hang, during the survey and after.
    changed
        Share of the pallets that were moved since the survey.
    seed
        Draws the building, what was moved, and what the calibration is off by.
    """
    _check(runs, reflectors, changed, seed)
    given = {"runs": runs, "reflectors": reflectors, "changed": changed, "seed": seed}
    with Run("recording", "simulate localization", output, settings={"simulate": given}) as run:
        planned = list(drives(runs))
        with run.stage("drives", len(planned)) as show:
            for count, (name, drive, noise) in enumerate(run.until_cancelled(planned), 1):
                day = Day(seed, 0, 0.0, reflectors) if drive == "survey" else Day(seed, 1, changed, reflectors)
                plan = drive_scenario(drive, day, noise)
                driven = _written(run, name, plan)
                show(count)
                if drive == "survey":
                    write_vehicle(run.path("vehicle.toml"), calibrated_vehicle(plan, seed))
                    write_reflectors(run.path("reflectors.csv"), standing_reflectors(driven.circles, driven.segments))
        shares = f"{reflectors:.0%} of the reflectors, {changed:.0%} of the pallets moved"
        run.finish({"drives": len(planned)}, f"{len(planned)} drives, {shares}, seed {seed}.")


def _written(run: Run, name: str, plan: Scenario) -> Simulated:
    """Simulate a drive and write its recording and its truth."""
    driven = simulate(plan, run.token)
    write_recording(run.path(f"{name}.mcap"), driven)
    write_tum(run.path(f"{name}-truth.tum"), driven.stamps, driven.truth)
    length = np.hypot(*np.diff(driven.truth[:, :2], axis=0).T).sum()
    run.say(f"{name}.mcap: {len(driven.scan_stamps)} scans, {length:.0f} m")
    return driven


def _check(runs: int, reflectors: float, changed: float, seed: int) -> None:
    if runs < 1:
        raise UserError(f"--runs {runs}: must be at least 1")
    for name, share in (("reflectors", reflectors), ("changed", changed)):
        if not 0 <= share <= 1:
            raise UserError(f"--{name} {share}: is a share, from 0 to 1")
    if seed < 0:
        raise UserError(f"--seed {seed}: must be at least 0")

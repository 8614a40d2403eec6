"""`groma simulate localization`: a warehouse to map on one day and to find oneself in on others, with the truth."""

from __future__ import annotations

import sys
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
from groma.simulation import simulate


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
        Folder to write to; it is made when missing.
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
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{output}: cannot be made a folder ({error.strerror})") from error
    survey, later = Day(seed, 0, 0.0, reflectors), Day(seed, 1, changed, reflectors)
    for name, drive, noise in drives(runs):
        plan = drive_scenario(drive, survey if drive == "survey" else later, noise)
        run = simulate(plan)
        write_recording(output / f"{name}.mcap", run)
        write_tum(output / f"{name}-truth.tum", run.stamps, run.truth)
        length = np.hypot(*np.diff(run.truth[:, :2], axis=0).T).sum()
        print(f"{output / name}.mcap: {len(run.scan_stamps)} scans, {length:.0f} m", file=sys.stderr)
        if drive == "survey":
            write_vehicle(output / "vehicle.toml", calibrated_vehicle(plan, seed))
            write_reflectors(output / "reflectors.csv", standing_reflectors(run.circles, run.segments))
    count = sum(1 for _ in drives(runs))
    print(
        f"{output}: {count} drives, {reflectors:.0%} of the reflectors, {changed:.0%} of the pallets moved, seed {seed}"
    )


def _check(runs: int, reflectors: float, changed: float, seed: int) -> None:
    if runs < 1:
        raise UserError(f"--runs {runs}: must be at least 1")
    for name, share in (("reflectors", reflectors), ("changed", changed)):
        if not 0 <= share <= 1:
            raise UserError(f"--{name} {share}: is a share, from 0 to 1")
    if seed < 0:
        raise UserError(f"--seed {seed}: must be at least 0")

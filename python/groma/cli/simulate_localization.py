"""`groma simulate localization`: a warehouse to map on one day and to find oneself in on others, with the truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter

from groma.cli.simulated import seed_of
from groma.errors import UserError
from groma.io.recording import write_recording
from groma.io.reflector_list import write_reflectors
from groma.io.trajectory import write_tum
from groma.io.vehicle_file import write_vehicle
from groma.runs.run import Run
from groma.runs.settings import Settings
from groma.runs.tables import settings_of, typed
from groma.simulation.localization import (
    DriveName,
    Rounds,
    calibrated_vehicle,
    drive_scenario,
    drives,
    standing_reflectors,
)
from groma.simulation.scenes import Scenario, Simulated, simulate


def localization(
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    runs: int | None = None,
    reflectors: float | None = None,
    changed: float | None = None,
    seed: int | None = None,
    config: Path | None = None,
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
        Drives along each path; six when left out.
    reflectors
        Share of the reflectors that hang, during the survey and after; 1 when left out.
    changed
        Share of the pallets that were moved since the survey; 0.1 when left out.
    seed
        Draws the building, what was moved, and what the calibration is off by; 1 when left out.
    config
        TOML with a table [simulate_localization] (groma config prints it) or the run.toml of another run.
    """
    options = {"runs": runs, "reflectors": reflectors, "changed": changed, "seed": seed}
    settings = settings_of("simulate_localization", config, **options)
    rounds = _checked(settings)
    with Run("recording", "simulate localization", output, settings={"simulate_localization": settings}) as run:
        planned = list(drives(rounds.runs))
        done = _driven(run, rounds, planned)
        shares = f"{rounds.reflectors:.0%} of the reflectors, {rounds.changed:.0%} of the pallets moved"
        run.finish({"drives": done}, f"{done} drives, {shares}, seed {rounds.seed}.")


def _driven(run: Run, rounds: Rounds, planned: list[tuple[str, DriveName, int]]) -> int:
    """Simulate and write drives, and return how many; an interruption keeps those that are whole."""
    done = 0
    with run.stage("drives", len(planned)) as show:
        try:
            for name, drive, noise in planned:
                plan = drive_scenario(drive, rounds.day(drive), noise)
                driven = _written(run, name, plan)
                done += 1
                show(done)
                if drive == "survey":
                    write_vehicle(run.path("vehicle.toml"), calibrated_vehicle(plan, rounds.seed))
                    write_reflectors(run.path("reflectors.csv"), standing_reflectors(driven.circles, driven.segments))
        except KeyboardInterrupt:
            if done == 0:
                raise
    return done


def _written(run: Run, name: str, plan: Scenario) -> Simulated:
    """Simulate a drive and write its recording and its truth."""
    driven = simulate(plan, run.token)
    write_recording(run.path(f"{name}.mcap"), run.whole(driven))
    write_tum(run.path(f"{name}-truth.tum"), driven.stamps, driven.truth)
    length = np.hypot(*np.diff(driven.truth[:, :2], axis=0).T).sum()
    run.say(f"{name}.mcap: {len(driven.scan_stamps)} scans, {length:.0f} m")
    return driven


def _checked(settings: Settings) -> Rounds:
    seed_of(settings)
    rounds = typed(Rounds, settings, "simulate_localization")
    if rounds.runs < 1:
        raise UserError(f"--runs {rounds.runs}: must be at least 1")
    for name, share in (("reflectors", rounds.reflectors), ("changed", rounds.changed)):
        if not 0 <= share <= 1:
            raise UserError(f"--{name} {share}: is a share, from 0 to 1")
    return rounds

"""`groma simulate vehicle`: a recording to calibrate a vehicle by, with the parameters that are to be found."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from cyclopts import Parameter

from groma.cli.simulate import recording_stem
from groma.errors import UserError
from groma.io.recording import write_recording
from groma.io.trajectory import write_tum
from groma.io.vehicle_file import write_vehicle
from groma.vehicle import Model
from groma.vehicle_simulation import (
    Arcs,
    CalibrationDrive,
    CalibrationScenario,
    Continuous,
    Differential,
    Tricycle,
    calibration_scenario,
    simulate_calibration,
    true_vehicle,
)

ASYMMETRY = math.radians(6.74)
"""Difference of the steering offsets of an asymmetric tricycle [rad] (Kallasi 2017, table 5.2)."""


def vehicle(
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    model: Model = "tricycle",
    drive: Literal["arcs", "continuous"] = "arcs",
    arcs: int = 16,
    duration: float = 60.0,
    delay: float = 0.0,
    seed: int = 1,
) -> None:
    """Simulate a drive to calibrate by: writes FILE, FILE-truth.toml (the vehicle) and FILE-truth.tum (its path).

    groma simulate vehicle -o agv.mcap

    groma simulate vehicle -o agv.mcap --drive continuous --duration 30 --delay 0.03

    Parameters
    ----------
    output
        Recording to write: .csv, .csv.gz or .mcap.
    model
        What drives.
    drive
        arcs: from standstill to standstill, left and right, forward and backward. continuous: ordinary driving.
    arcs
        Number of arcs, a multiple of 4.
    duration
        Of continuous driving [s].
    delay
        By how much the stamps of the wheels are later than those of the scans [s].
    seed
        Draws the hall and all noise.
    """
    stem = recording_stem(output)
    simulated = simulate_calibration(_scenario(model, drive, arcs, duration, delay, seed))
    write_recording(output, simulated)
    write_vehicle(stem.with_name(stem.name + "-truth.toml"), true_vehicle(simulated.scenario))
    write_tum(stem.with_name(stem.name + "-truth.tum"), simulated.wheel_stamps - delay, simulated.truth)
    print(f"{output}: {_summary(simulated)}, seed {seed}")


def _scenario(model: Model, drive: str, arcs: int, duration: float, delay: float, seed: int) -> CalibrationScenario:
    if arcs < 4 or arcs % 4:
        raise UserError(f"--arcs {arcs}: must be a multiple of 4: every angle is driven left, right, forward, backward")
    if not 0 < duration < 1e5:
        raise UserError(f"--duration {duration}: must be above 0")
    if not abs(delay) < 10:
        raise UserError(f"--delay {delay}: is seconds, below 10")
    if seed < 0:
        raise UserError(f"--seed {seed}: must be at least 0")
    drivetrain: Tricycle | Differential = Differential() if model == "differential" else Tricycle()
    if isinstance(drivetrain, Tricycle) and model == "tricycle-asymmetric":
        forward = drivetrain.steering_offset_forward
        drivetrain = msgspec.structs.replace(drivetrain, steering_offset_backward=forward - ASYMMETRY)
    scenario = calibration_scenario(drivetrain, seed)
    program = scenario.program
    if isinstance(program, Arcs):
        largest = program.to
        arc_program = msgspec.structs.replace(program, angles=arcs // 4)
        chosen = Continuous(duration, largest) if drive == "continuous" else arc_program
        scenario = msgspec.structs.replace(scenario, program=chosen, delay=delay)
    return scenario


def _summary(simulated: CalibrationDrive) -> str:
    steps = np.diff(simulated.truth[:, :2], axis=0)
    length, time = np.hypot(*steps.T).sum(), simulated.wheel_stamps[-1] - simulated.wheel_stamps[0]
    return f"{len(simulated.scan_stamps)} scans, {length:.0f} m in {time:.0f} s"

"""`groma simulate vehicle`: a recording to calibrate a vehicle by, with the parameters that are to be found."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from cyclopts import Parameter

from groma.cli.simulated import recording_stem, seed_of
from groma.errors import UserError
from groma.io.recording import write_recording
from groma.io.trajectory import write_tum
from groma.io.vehicle_file import write_vehicle
from groma.nouns.vehicle import Model
from groma.runs.tables import settings_of, typed
from groma.simulation.vehicle import (
    Arcs,
    CalibrationDrive,
    CalibrationScenario,
    Continuous,
    Course,
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
    model: Model | None = None,
    drive: Literal["arcs", "continuous"] | None = None,
    arcs: int | None = None,
    duration: float | None = None,
    delay: float | None = None,
    seed: int | None = None,
    config: Path | None = None,
) -> None:
    """Simulate a drive to calibrate by: writes FILE, FILE-truth.toml (the vehicle) and FILE-truth.tum (its path).

    groma simulate vehicle -o agv.mcap

    groma simulate vehicle -o agv.mcap --drive continuous --duration 30 --delay 0.03

    Parameters
    ----------
    output
        Recording to write: .csv, .csv.gz or .mcap.
    model
        What drives; a tricycle when left out.
    drive
        arcs: from standstill to standstill, left and right, forward and backward. continuous: ordinary driving.
        arcs when left out.
    arcs
        Number of arcs, a multiple of 4; 16 when left out.
    duration
        Of continuous driving [s]; 60 when left out.
    delay
        By how much the stamps of the wheels are later than those of the scans [s]; 0 when left out.
    seed
        Draws the hall and all noise; 1 when left out.
    config
        TOML with a table [simulate_vehicle] (groma config prints it).
    """
    stem = recording_stem(output)
    options = {"model": model, "drive": drive, "arcs": arcs, "duration": duration, "delay": delay, "seed": seed}
    settings = settings_of("simulate_vehicle", config, **options)
    seed_of(settings)
    course = typed(Course, settings, "simulate_vehicle")
    simulated = simulate_calibration(_scenario(course))
    write_recording(output, simulated)
    write_vehicle(stem.with_name(stem.name + "-truth.toml"), true_vehicle(simulated.scenario))
    write_tum(stem.with_name(stem.name + "-truth.tum"), simulated.wheel_stamps - course.delay, simulated.truth)
    print(f"{output.name}: {_summary(simulated)}, seed {course.seed}")


def _scenario(course: Course) -> CalibrationScenario:
    if course.arcs < 4 or course.arcs % 4:
        rule = "must be a multiple of 4: every angle is driven left, right, forward, backward"
        raise UserError(f"--arcs {course.arcs}: {rule}")
    if not 0 < course.duration < 1e5:
        raise UserError(f"--duration {course.duration}: must be above 0")
    if not abs(course.delay) < 10:
        raise UserError(f"--delay {course.delay}: is seconds, below 10")
    scenario = calibration_scenario(_drivetrain(course.model), course.seed)
    program = scenario.program
    if isinstance(program, Arcs):
        arcs = msgspec.structs.replace(program, angles=course.arcs // 4)
        driven = Continuous(course.duration, program.to) if course.drive == "continuous" else arcs
        scenario = msgspec.structs.replace(scenario, program=driven, delay=course.delay)
    return scenario


def _drivetrain(model: Model) -> Tricycle | Differential:
    if model == "differential":
        return Differential()
    tricycle = Tricycle()
    if model == "tricycle":
        return tricycle
    backward = tricycle.steering_offset_forward - ASYMMETRY
    return msgspec.structs.replace(tricycle, steering_offset_backward=backward)


def _summary(simulated: CalibrationDrive) -> str:
    steps = np.diff(simulated.truth[:, :2], axis=0)
    length, time = np.hypot(*steps.T).sum(), simulated.wheel_stamps[-1] - simulated.wheel_stamps[0]
    return f"{len(simulated.scan_stamps)} scans, {length:.0f} m in {time:.0f} s"

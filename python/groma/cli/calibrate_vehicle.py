"""`groma calibrate vehicle`: a recording in, the parameters of wheels, steering and laser out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, get_args

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.quantities import amounts
from groma.nouns.vehicle import PARAMETERS, Model
from groma.runs.run import Run
from groma.runs.tables import settings_of
from groma.runs.vehicle import calibrate_into, request_of
from groma.vehicle.calibration import Free
from groma.vehicle.recording import Request


def vehicle(
    file: Path,
    /,
    *,
    model: Model | Literal["auto"] | None = None,
    wheelbase: float | None = None,
    free: str | None = None,
    tolerance: str | None = None,
    wheels: str | None = None,
    joints: str | None = None,
    axle: float | None = None,
    scans: str | None = None,
    poses: str | None = None,
    window: float | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
) -> None:
    """Calibrate a vehicle from a recording: wheels, steering, pose of the laser, with 95 % intervals. No first guess.

    groma calibrate vehicle agv.mcap

    groma calibrate vehicle agv.mcap --wheelbase 1.5 --tolerance laser_x=2mm,laser_yaw=0.05deg -o agv

    Parameters
    ----------
    file
        A recording with wheels (joint states, ticks) and laser scans, or poses of the sensor.
    model
        What drives; auto, when left out: a tricycle where a joint steers, asymmetric where that is significant.
    wheelbase
        Of a tricycle [m]; estimated when left out.
    free
        What to estimate beside: gain, delay, wheelbase, separated by commas.
    tolerance
        Largest half-widths of 95 % intervals, as name=number with mm, m, deg, rad, ms, s or %, separated by commas.
    wheels
        Name of the joint or odometry stream, if there are several.
    joints
        Names of the joints, separated by a comma: traction and steering, or left and right.
    axle
        Wheel separation by which odometry was made, for a recording that has no joints [m]; 1 when left out.
    scans
        Name of the scan stream, if there are several.
    poses
        Name of an odometry stream that has poses of the sensor, to be used instead of scans.
    window
        Cut the drive into windows so long [s], also where it stops and goes.
    output
        Folder for the results; a new one in results/ when left out.
    config
        TOML with a table [calibrate] (groma config prints it) or the run.toml of another run.
    """
    options = {
        "model": model,
        "wheelbase": wheelbase,
        "free": None if free is None else list(_free(free)),
        "wheels": wheels,
        "joints": None if joints is None else list(_names(joints)),
        "axle": axle,
        "scans": scans,
        "poses": poses,
        "window": window,
        "tolerance": tolerance,
    }
    settings = settings_of("calibrate", config, **options)
    request = request_of(settings)
    _check(request, str(settings["tolerance"]))
    with Run("vehicle", "calibrate vehicle", output) as run:
        calibrate_into(run, run.open(file), request, str(settings["tolerance"]))


def _check(request: Request, tolerance: str) -> None:
    if tolerance:
        amounts(tolerance, {name: 1.0 for names in PARAMETERS.values() for name in names}, "--tolerance")
    for name, value in (("wheelbase", request.wheelbase), ("axle", request.axle), ("window", request.window)):
        if value is not None and not (math.isfinite(value) and (value > 0 or name == "wheelbase")):
            raise UserError(f"--{name} {value}: must be above 0")
    if request.wheelbase == 0:
        raise UserError("--wheelbase 0: is the distance from the fixed axle to the steered wheel")
    if request.wheelbase is not None and "wheelbase" in request.free:
        raise UserError("--wheelbase and --free wheelbase contradict each other: give one of them")


def _free(text: str) -> tuple[Free, ...]:
    chosen = _names(text)
    if unknown := [name for name in chosen if name not in get_args(Free)]:
        raise UserError(f"--free {unknown[0]}: there are {', '.join(get_args(Free))}")
    return tuple(name for name in get_args(Free) if name in chosen)


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())

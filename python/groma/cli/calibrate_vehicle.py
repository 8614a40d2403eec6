"""`groma calibrate vehicle`: a recording in, the parameters of wheels, steering and laser out."""

from __future__ import annotations

import math
import sys
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal, get_args

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from groma.calibration import Free
from groma.errors import EstimationError, UserError
from groma.io.calibration_results import save_calibration
from groma.io.quantities import amounts
from groma.io.recording import Recording, open_recording
from groma.io.results import point_latest, result_directory, shown_command
from groma.io.streams import Kind
from groma.report.calibration_words import misfits, rows, verdict_words
from groma.vehicle import PARAMETERS, Model
from groma.vehicle_calibration import CalibratedVehicle, Request, calibrate_vehicle, judged


def vehicle(
    file: Path,
    /,
    *,
    model: Model | Literal["auto"] = "auto",
    wheelbase: float | None = None,
    free: str = "",
    tolerance: str = "",
    wheels: str | None = None,
    joints: str = "",
    axle: float = 1.0,
    scans: str | None = None,
    poses: str | None = None,
    window: float | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Calibrate a vehicle from a recording: wheels, steering, pose of the laser, with honest intervals. No first guess.

    groma calibrate vehicle agv.mcap

    groma calibrate vehicle agv.mcap --wheelbase 1.5 --tolerance laser_x=2mm,laser_yaw=0.05deg -o agv

    Parameters
    ----------
    file
        A recording with wheels (joint states, ticks) and laser scans, or poses of the sensor.
    model
        What drives; auto: a tricycle where a joint steers, asymmetric where that is significant.
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
        Wheel separation by which odometry was made, for a recording that has no joints [m].
    scans
        Name of the scan stream, if there are several.
    poses
        Name of an odometry stream that has poses of the sensor, to be used instead of scans.
    window
        Cut the drive into windows so long [s], also where it stops and goes.
    output
        Folder for the results; a new one in results/ when left out.
    """
    request = Request(model, wheelbase, _free(free), wheels, _names(joints), axle, scans, poses, window)
    _check(request, tolerance)
    recording = open_recording(file)
    directory = result_directory(output, datetime.now().astimezone())
    result = _or_nothing(directory, recording, request, tolerance)
    if output is None:
        point_latest(directory)
    _tell(result, recording, directory)


def _or_nothing(directory: Path, recording: Recording, request: Request, tolerance: str) -> CalibratedVehicle:
    """Calibrate into a folder; an empty one is removed when that fails."""
    try:
        return calibrate_into(directory, recording, request, tolerance, shown_command(sys.argv[1:]))
    except BaseException:
        if not any(directory.iterdir()):
            directory.rmdir()
        raise


def calibrate_into(
    directory: Path, recording: Recording, request: Request, tolerance: str, command: str
) -> CalibratedVehicle:
    """Calibrate, with progress on a terminal, and write all files into a folder that exists."""
    result = _with_progress(recording, request)
    values = dict(zip(result.found.names, result.found.values.tolist(), strict=True))
    if tolerance:
        result = judged(result, amounts(tolerance, values, "--tolerance"))
    settings = {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(request).items()}
    save_calibration(result, {"calibrate": {**settings, "tolerance": tolerance}}, recording.path, directory, command)
    return result


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


def _with_progress(recording: Recording, request: Request) -> CalibratedVehicle:
    counts = [s.count for s in recording.streams if s.kind is Kind.SCAN and request.scans in (None, s.name)]
    total = max((count for count in counts if count is not None), default=None)
    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("scans"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("calibrate", total=total)
        show = None if progress.disable else (lambda count: progress.update(task, completed=count))
        return calibrate_vehicle(recording, request, show)


def _tell(result: CalibratedVehicle, recording: Recording, directory: Path) -> None:
    for note in [*result.data.notes, *result.found.notes, *recording.notes.lines()]:
        if note not in recording.notes.assumptions or note in result.data.notes:
            print(f"note: {note}", file=sys.stderr)
    for what, count in sorted(result.data.counts.items()):
        if count and what != "motions used":
            print(f"left out: {count} {what.removeprefix('motions: ')}", file=sys.stderr)
    for line in misfits(result):
        print(f"note: {line}", file=sys.stderr)
    table = rows(result)
    widths = [max(len(row[k]) for row in table) for k in range(5)]
    for row in table:
        print("  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip())
    print(f"{verdict_words(result)}.")
    print(f"{directory / 'report.html'}")
    if result.found.weak:
        raise EstimationError(f"{recording.path}: the drive leaves parameters open, so there is no vehicle.toml")

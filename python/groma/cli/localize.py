"""`groma localize`: a recording and a map in, the poses of the vehicle in the map out."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from groma.errors import EstimationError, UserError
from groma.io.chart import read_chart
from groma.io.drive import Drive, open_drive
from groma.io.localization_results import save_localized
from groma.io.recording import open_recording
from groma.io.results import point_latest, result_directory, run_record, shown_command
from groma.io.trajectory import Trajectory
from groma.io.vehicle_file import read_vehicle
from groma.localization import LocalizerOptions, localizer_defaults
from groma.localize import Request, localize_drive
from groma.localized import Chart, Localized
from groma.mapping import Landmarks, no_landmarks
from groma.report.localization_report import localization_verdict
from groma.settings import Settings, merged, read_table
from groma.survey import survey

Mode = Literal["static", "dynamic", "mixed", "reflectors"]


def localize(
    file: Path,
    /,
    *,
    map_: Annotated[Path | None, Parameter(name="--map")] = None,
    vehicle: Path | None = None,
    start: str = "unknown",
    mode: Mode | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    scans: str | None = None,
    odometry: str | None = None,
    config: Path | None = None,
) -> None:
    """Localize a recording in a map: trajectory with covariances, quality of every pose, halts, and a report.

    groma localize day2.mcap --map results/latest --vehicle vehicle.toml

    groma localize day2.mcap --map reflectors.csv --mode mixed --start 1.5,2,0.1

    Parameters
    ----------
    file
        What `groma inspect` can read, with odometry or, for a --vehicle, joint states.
    map_
        Folder of `groma map`, landmark map (.json), nav2 map (.yaml), or list of reflectors (.csv: x,y in metres). May
        be left out in the mode dynamic.
    vehicle
        A vehicle.toml of `groma calibrate vehicle`: its wheels and its laser are used instead of the odometry.
    start
        Where the drive begins in the map: x,y,theta in metres and radians, or unknown to find out.
    mode
        Landmarks that hold the pose. static: those of the map. dynamic: corners found on the way. mixed: both.
        reflectors: the reflectors of the map alone. Where landmarks are few, static and mixed keep to the walls too.
    output
        Folder for the results; a new one in results/ when left out.
    scans
        Name of the scan stream, if there are several.
    odometry
        Name of the odometry stream, if there are several.
    config
        TOML with a table [localize], or the run.toml of another run.
    """
    settings = _settings(config, mode)
    pose = _start(start, settings["mode"] == "dynamic" and map_ is None)
    chart = _chart(map_, str(settings["mode"]))
    wheels = read_vehicle(vehicle) if vehicle else None
    recording = open_recording(file)
    drive = open_drive(recording, scans=scans, odometry="none" if wheels else odometry)
    directory = result_directory(output, datetime.now().astimezone())
    request = Request(chart, LocalizerOptions(**settings), pose, wheels)  # type: ignore[typeddict-item]
    run = run_record({"localize": {**settings, "start": start}}, file, shown_command(sys.argv[1:]))
    result = localize_into(directory, drive, request, run | {"map": _named(map_), "vehicle": _named(vehicle)})
    if output is None:
        point_latest(directory)
    _tell(result, drive, directory)


def localize_into(directory: Path, drive: Drive, request: Request, run: Mapping[str, object]) -> Localized:
    """Localize a drive, with progress on a terminal, and write all files into a folder that exists."""
    result = _with_progress(drive, request)
    save_localized(result, _seen(drive, result, request), run, directory)
    return result


def _settings(config: Path | None, mode: str | None) -> Settings:
    defaults: Settings = dict(localizer_defaults())
    settings = merged(defaults, read_table(config, "localize") if config else {}, "localize")
    return merged(settings, {"mode": mode} if mode else {}, "localize")


def _chart(path: Path | None, mode: str) -> Chart:
    if path is None:
        if mode != "dynamic":
            raise UserError(f"--map: the mode {mode} needs a map")
        return Chart(no_landmarks())
    chart = read_chart(path)
    if mode == "reflectors" and not (chart.landmarks.kinds == "reflector").any():
        raise UserError(f"{path}: no reflector in it: the mode reflectors needs some")
    return chart


def _start(text: str, at_origin: bool) -> tuple[float, float, float] | None:
    if text == "unknown":
        return (0.0, 0.0, 0.0) if at_origin else None
    try:
        x, y, theta = (float(part) for part in text.split(","))
    except ValueError:
        raise UserError(f"--start {text}: expected x,y,theta in metres and radians, or unknown") from None
    if not all(map(math.isfinite, (x, y, theta))):
        raise UserError(f"--start {text}: the numbers must be finite")
    return x, y, theta


def _seen(drive: Drive, result: Localized, request: Request) -> Landmarks | None:
    """Return what was seen on the way, at the poses found; None where that is nothing."""
    known = result.status != "lost"
    if known.sum() < 2:
        return None
    trajectory = Trajectory(result.stamps[known], result.poses[known])
    mount = request.vehicle.laser if request.vehicle else None
    try:
        return survey(drive, trajectory, {}, covariances=result.covariances[known], mount=mount).landmarks
    except EstimationError:
        return None


def _named(path: Path | None) -> str | None:
    return path.resolve().name if path else None


def _with_progress(drive: Drive, request: Request) -> Localized:
    counts = [stream.count for stream in drive.recording.streams if stream.name == drive.scans]
    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("scans {task.fields[state]}"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("localize", total=counts[0] if counts else None, state="")

        def show(scans: int, status: str, sigma: float) -> None:
            if scans % 20 == 0:
                progress.update(task, completed=scans, state=f"{status}, sigma {1000 * sigma:.0f} mm")

        return localize_drive(drive, request, None if progress.disable else show)


def _tell(result: Localized, drive: Drive, directory: Path) -> None:
    for note in [*drive.notes, *drive.recording.notes.lines()]:
        print(f"note: {note}", file=sys.stderr)
    for reason, count in drive.skipped.items():
        print(f"skipped: {count} {reason}", file=sys.stderr)
    print(f"{localization_verdict(result)}.")
    print(f"{directory / 'report.html'}")
    if result.found_after is None:
        raise EstimationError(f"{drive.recording.path}: the vehicle was never found in the map")

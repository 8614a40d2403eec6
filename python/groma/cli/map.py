"""`groma map`: a recording in, a map out."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from time import monotonic
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from groma.errors import UserError
from groma.io.drive import Drive, open_drive
from groma.io.recording import open_recording
from groma.io.results import point_latest, result_directory, run_record, save_map, save_survey, shown_command
from groma.io.trajectory import read_tum
from groma.io.vehicle_file import read_vehicle
from groma.io.wheel_drive import STREAM, open_wheel_drive
from groma.mapper import map_defaults, map_drive
from groma.mapping import MapResult
from groma.report.words import verdict
from groma.settings import Settings, merged, read_table
from groma.survey import survey


def map_(
    file: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    scans: str | None = None,
    odometry: str | None = None,
    vehicle: Path | None = None,
    online: bool = False,
    resolution: float | None = None,
    landmarks: Path | None = None,
    config: Path | None = None,
    threads: int | None = None,
    rerun: bool = False,
) -> None:
    """Map a building from a recording: nav2 map, trajectory, pose graph, landmarks and a report.

    groma map drive.mcap

    groma map intel.clf.gz --odometry none -o out

    groma map drive.mcap --landmarks poses.tum

    Parameters
    ----------
    file
        What `groma inspect` can read.
    output
        Folder for the results; a new one in results/ when left out.
    scans
        Name of the scan stream, if there are several.
    odometry
        Name of the odometry stream, or none to map from the scans alone.
    vehicle
        vehicle.toml of groma calibrate vehicle: odometry from its wheels, its laser where it was found.
    online
        Let every pose use only what was seen before it.
    resolution
        Cell of the occupancy map [m].
    landmarks
        Poses of the drive that are known (TUM): map landmarks and occupancy at these, in their frame, instead of
        estimating any.
    config
        TOML with a table [map] (groma config prints it) or the run.toml of another run.
    threads
        Threads to use; all cores when left out. The result does not depend on it.
    rerun
        Also write map.rrd for the rerun viewer (pip install groma[rerun]).
    """
    if rerun:
        from groma.view.rerun import load_rerun

        load_rerun()
    if threads is not None and threads < 1:
        raise UserError(f"--threads {threads}: must be at least 1")
    if threads is not None:
        os.environ["RAYON_NUM_THREADS"] = str(threads)
    chosen: Settings = {"online": online or None, "resolution": resolution, "scans": scans, "odometry": odometry}
    settings = _settings(config, chosen)
    drive = _drive(file, vehicle, _name(settings, "scans"), _name(settings, "odometry"))
    new = output is None or not output.exists()
    directory = result_directory(output, datetime.now().astimezone())
    try:
        told = _map(directory, drive, settings, landmarks, rerun)
    except BaseException:
        if new and not any(directory.iterdir()):
            directory.rmdir()
        raise
    if output is None:
        point_latest(directory)
    _tell_notes(drive)
    print(told)


def _map(directory: Path, drive: Drive, settings: Settings, poses: Path | None, rerun: bool) -> str:
    """Map a drive into a folder and return what is to be told of it."""
    command = shown_command(sys.argv[1:])
    if poses is not None:
        return map_at_poses(directory, drive, settings, command, poses)
    result = map_into(directory, drive, settings, command)
    if rerun:
        from groma.view.rerun import save_rrd

        save_rrd(result, directory / "map.rrd")
    _tell_counts(result)
    return f"{verdict(result)}\n{directory / 'report.html'}"


def map_into(directory: Path, drive: Drive, settings: Settings, command: str) -> MapResult:
    """Map a drive, with progress on a terminal, and write all files into a folder that exists."""
    result = _with_progress(drive, settings)
    made = {**settings, "scans": drive.scans, "odometry": (drive.odometry or "none").partition(":")[0]}
    save_map(result, {"map": made}, drive.recording.path, directory, command)
    return result


def map_at_poses(directory: Path, drive: Drive, settings: Settings, command: str, poses: Path) -> str:
    """Map landmarks and occupancy at known poses into a folder that exists, and return what is to be told of it."""
    trajectory = read_tum(poses)
    result = survey(drive, trajectory, settings)
    run = run_record({"map": settings}, drive.recording.path, command)
    save_survey(result, trajectory, run | {"poses": poses.resolve().name}, directory)
    kinds, scans = result.landmarks.kinds.tolist(), result.counts["keyframes"]
    counted = f"{kinds.count('corner')} corners and {kinds.count('reflector')} reflectors from {scans} scans"
    return f"{directory / 'landmarks.json'}: {counted}"


def _drive(file: Path, vehicle: Path | None, scans: str | None, odometry: str | None) -> Drive:
    if vehicle is None:
        return open_drive(open_recording(file), scans=scans, odometry=odometry)
    if odometry not in (None, STREAM):
        raise UserError(f"--odometry {odometry} and --vehicle contradict each other: give one of them")
    return open_wheel_drive(open_recording(file), read_vehicle(vehicle), scans=scans)


def _settings(config: Path | None, chosen: Settings) -> Settings:
    """Return the defaults, changed by the file, changed by the options."""
    settings = merged(map_defaults(), read_table(config, "map") if config else {}, "map")
    return merged(settings, {key: value for key, value in chosen.items() if value is not None}, "map")


def _name(settings: Settings, stream: str) -> str | None:
    return str(settings[stream]) or None


def _with_progress(drive: Drive, settings: Settings) -> MapResult:
    counts = [stream.count for stream in drive.recording.streams if stream.name == drive.scans]
    total = counts[0] if counts else None
    console = Console(stderr=True)
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("scans {task.fields[state]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("map", total=total, state="")

        start = monotonic()

        def show(scans: int, keyframes: int, local_maps: int, closures: int) -> None:
            if scans % 20 == 0:
                rate = scans / (monotonic() - start)
                state = f"{rate:.0f}/s, {keyframes} keyframes, {local_maps} local maps, {closures} closures"
                progress.update(task, completed=scans, state=state)

        return map_drive(drive, settings, None if progress.disable else show)


def _offset_note(counts: Mapping[str, float]) -> str | None:
    """Return what odometry and scans say of the laser's place, when it is not where the recording puts it."""
    x, y = counts["laser_offset_x_m"], counts["laser_offset_y_m"]
    sigma = max(counts["laser_offset_x_sigma_m"], counts["laser_offset_y_sigma_m"])
    if math.hypot(x, y) < max(0.05, 3 * sigma):
        return None
    return (
        f"odometry and scans agree best with the laser {x:.2f} m ahead and {y:.2f} m to the left of where the "
        "recording puts it; the poses written are those of the frame that the recording gives"
    )


def _tell_counts(result: MapResult) -> None:
    if offset := _offset_note(result.counts):
        print(f"note: {offset}", file=sys.stderr)
    if failed := int(result.counts["scans_whose_odometry_failed"]):
        print(f"note: odometry foretold {failed} scans so badly that it was left out there", file=sys.stderr)


def _tell_notes(drive: Drive) -> None:
    for note in [*drive.notes, *drive.recording.notes.lines()]:
        print(f"note: {note}", file=sys.stderr)
    for reason, count in drive.skipped.items():
        print(f"skipped: {count} {reason}", file=sys.stderr)

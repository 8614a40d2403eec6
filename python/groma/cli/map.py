"""`groma map`: a recording in, a map out."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.recording import Recording
from groma.io.vehicle_file import read_vehicle
from groma.recordings.drive import WHEELS, Drive, open_drive, open_vehicle_drive
from groma.runs.kinds import file_in
from groma.runs.map import map_at_poses_into, map_into
from groma.runs.run import Run
from groma.runs.settings import Settings
from groma.runs.tables import settings_of


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
    _use_threads(threads)
    options = {"online": online or None, "resolution": resolution, "scans": scans, "odometry": odometry}
    settings = settings_of("map", config, **options)
    with Run("map", "map", output) as run:
        drive = _drive(run.open(file), vehicle, settings)
        run.inputs["vehicle"] = vehicle
        if landmarks is not None:
            map_at_poses_into(run, drive, settings, landmarks)
            return
        result = map_into(run, drive, settings)
        if rerun:
            from groma.view.rerun import save_rrd

            save_rrd(result, run.path("map.rrd"))


def _use_threads(threads: int | None) -> None:
    if threads is None:
        return
    if threads < 1:
        raise UserError(f"--threads {threads}: must be at least 1")
    os.environ["RAYON_NUM_THREADS"] = str(threads)


def _drive(recording: Recording, vehicle: Path | None, settings: Settings) -> Drive:
    scans, odometry = (str(settings[stream]) or None for stream in ("scans", "odometry"))
    if vehicle is None:
        return open_drive(recording, scans=scans, odometry=odometry)
    if odometry not in (None, WHEELS):
        raise UserError(f"--odometry {odometry} and --vehicle contradict each other: give one of them")
    return open_vehicle_drive(recording, read_vehicle(file_in(vehicle, "vehicle.toml", "vehicle")), scans=scans)

"""`groma localize`: a recording and a map in, the poses of the vehicle in the map out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.chart import read_chart
from groma.io.vehicle_file import read_vehicle
from groma.localization.drive import Request
from groma.localization.options import LocalizeOptions
from groma.nouns.maps import Chart, no_landmarks
from groma.recordings.drive import open_drive, open_vehicle_drive
from groma.runs.kinds import check_kind, file_in
from groma.runs.localization import localize_into
from groma.runs.run import Run
from groma.runs.tables import settings_of

Mode = Literal["static", "dynamic", "mixed", "reflectors"]
_STREAMS = ("scan_stream", "odometry_stream")
"""Settings that the core does not know: which streams are read."""


def localize(
    file: Path,
    /,
    *,
    map_: Annotated[Path | None, Parameter(name="--map")] = None,
    vehicle: Path | None = None,
    start: str | None = None,
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
        Where the drive begins in the map: x,y,theta in metres and radians, or unknown to find out (the default).
    mode
        Landmarks that constrain the pose. static: those of the map. dynamic: corners found during the drive. mixed:
        both. reflectors: the reflectors of the map alone. Where landmarks are few, static and mixed keep to the walls
        too.
    output
        Folder for the results; a new one in results/ when left out.
    scans
        Name of the scan stream, if there are several.
    odometry
        Name of the odometry stream, if there are several.
    config
        TOML with a table [localize] (groma config prints it) or the run.toml of another run.
    """
    given = {"start": start, "scan_stream": scans, "odometry_stream": odometry, "mode": mode}
    settings = settings_of("localize", config, **given)
    streams = {name: None if settings[name] is None else str(settings[name]) for name in _STREAMS}
    pose = _start(str(settings["start"]), settings["mode"] == "dynamic" and map_ is None)
    with Run("localization", "localize", output, settings={"localize": settings}) as run:
        recording = run.open(file)
        run.inputs |= {"map": map_, "vehicle": vehicle}
        wheels = read_vehicle(file_in(vehicle, "vehicle.toml", "vehicle")) if vehicle else None
        core = {key: value for key, value in settings.items() if key not in ("start", *streams)}
        options = LocalizeOptions(**core)  # type: ignore[typeddict-item]
        request = Request(_chart(map_, str(settings["mode"])), options, pose)
        read = streams["scan_stream"]
        if wheels:
            drive = open_vehicle_drive(recording, wheels, scans=read)
        else:
            drive = open_drive(recording, scans=read, odometry=streams["odometry_stream"])
        localize_into(run, drive, request)


def _chart(path: Path | None, mode: str) -> Chart:
    if path is None:
        if mode != "dynamic":
            raise UserError(f"--map: the mode {mode} needs a map")
        return Chart(no_landmarks())
    check_kind(path, "map", "promotion")
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

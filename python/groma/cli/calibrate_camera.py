"""`groma calibrate camera`: images of a target in, intrinsics with their uncertainty out."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from groma.camera_calibration import calibrate_camera, camera_defaults
from groma.camera_images import Sightings, find_targets
from groma.errors import EstimationError, UserError
from groma.io.camera_results import save_camera
from groma.io.detections import DetectionCache
from groma.io.images import count_images, read_images
from groma.io.notes import Notes
from groma.io.results import point_latest, result_directory, shown_command
from groma.io.target_file import read_target
from groma.report.camera_report import verdict
from groma.settings import Settings, merged, read_table
from groma.target import Target
from groma.vision import detection_defaults

Lens = Literal["pinhole", "radtan", "plumb_bob", "rational", "equidistant"]


def camera(
    images: Path,
    /,
    *,
    target: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    lens: Lens | None = None,
    name: str = "camera",
    config: Path | None = None,
) -> None:
    """Calibrate a camera from images of a target: intrinsics, their covariance, and a report.

    groma calibrate camera images --target april_6x6.yaml

    groma calibrate camera drive.mp4 --target panels.toml --lens equidistant --name door -o door

    Parameters
    ----------
    images
        Folder with images, or a video.
    target
        What is in them: a target of Kalibr (.yaml), or panels of groma (.toml).
    output
        Folder for the results; a new one in results/ when left out.
    lens
        Lens model. radtan (k1 k2 p1 p2) suits most lenses; plumb_bob and rational have more coefficients, equidistant
        is for fisheyes.
    name
        Name of the camera and of its files.
    config
        TOML with a table [camera] (groma config prints it) or the run.toml of another run.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name):
        raise UserError(f"--name {name!r}: letters, digits, _ . and - only, for files are named by it")
    settings = _settings(config, lens)
    panels = read_target(target)
    notes = Notes()
    count = count_images(images)
    new = output is None or not output.exists()
    directory = result_directory(output, datetime.now().astimezone())
    try:
        gates = settings["detection"]
        if not isinstance(gates, Mapping):
            raise UserError("setting camera.detection: is a table")
        cache = DetectionCache(directory.parent if output is None else directory, panels, gates)
        sightings = _look(images, panels, gates, cache, name, count, notes)
        cache.save()
        _tell_notes(sightings, notes)
        found = calibrate_camera(sightings.size, panels, sightings.detections, _core_settings(settings))
        record = {"camera": {**settings, "name": name, "target": panels.json()}}
        save_camera(name, found, sightings, record, images, directory, shown_command(sys.argv[1:]))
    except BaseException:
        if new and not any(directory.iterdir()):
            directory.rmdir()
        raise
    if output is None:
        point_latest(directory)
    print(verdict(found))
    print(f"{directory / 'report.html'}")


def _settings(config: Path | None, lens: str | None) -> Settings:
    settings = merged(camera_settings(), _known(read_table(config, "camera")) if config else {}, "camera")
    return merged(settings, {"lens": lens} if lens else {}, "camera")


def camera_settings() -> Settings:
    """Return all settings of `groma calibrate camera` with their defaults."""
    return {**camera_defaults(), "detection": detection_defaults()}


def _known(table: Mapping[str, object]) -> Mapping[str, object]:
    """Return a table without what only records a run."""
    return {key: value for key, value in table.items() if key not in ("name", "target")}


def _core_settings(settings: Settings) -> Settings:
    return {key: value for key, value in settings.items() if key != "detection"}


def _look(
    images: Path,
    panels: Target,
    gates: Mapping[str, object],
    cache: DetectionCache,
    name: str,
    count: int | None,
    notes: Notes,
) -> Sightings:
    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("images"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("detect", total=count)
        found = find_targets(
            read_images(images, notes),
            panels,
            gates,
            cache,
            camera=name,
            progress=lambda done: progress.update(task, completed=done),
        )
    if not found.detections:
        raise EstimationError(
            f"{images}: the target is in none of {len(found.names)} images: is it the right file, the right border?"
        )
    return found


def _tell_notes(sightings: Sightings, notes: Notes) -> None:
    for line in notes.lines():
        print(f"note: {line}", file=sys.stderr)
    if sightings.empty:
        print(f"note: no target in {len(sightings.empty)} of {len(sightings.names)} images", file=sys.stderr)
    for what, number in sightings.left_out.most_common():
        if number:
            print(f"left out: {number} {what}", file=sys.stderr)

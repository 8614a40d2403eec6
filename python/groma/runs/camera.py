"""The run of a camera calibration: a target found in images, a camera calibrated, into the folder of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from groma.cameras.calibration import CameraCalibration, calibrate_camera
from groma.cameras.detection_cache import DetectionCache
from groma.cameras.images import Sightings, find_targets
from groma.errors import EstimationError
from groma.io.images import count_images, read_images
from groma.io.notes import Notes
from groma.nouns.target import Target
from groma.report.camera.figures import camera_figures
from groma.report.camera.findings import camera_findings, sighting_findings
from groma.report.camera.report import camera_report, verdict
from groma.runs.camera_files import save_camera
from groma.runs.run import Run
from groma.runs.settings import Settings


def calibrate_camera_into(run: Run, images: Path, panels: Target, settings: Settings, name: str) -> CameraCalibration:
    """Calibrate a camera and finish the run with it.

    Raises
    ------
    EstimationError
        When the target is in none of the images, or its views do not allow a calibration.
    """
    run.inputs["input"] = images
    run.settings = {"camera": {**settings, "name": name, "target": panels.json()}}
    gates = dict(_table(settings["detection"]))
    sightings = _look(run, images, panels, gates, name)
    run.extend(sighting_findings(sightings))
    if not sightings.detections:
        raise EstimationError(
            f"{images}: the target is in none of {len(sightings.names)} images: is it the right file, the right border?"
        )
    core = {key: value for key, value in settings.items() if key != "detection"}
    found = calibrate_camera(sightings.size, panels, sightings.detections, core, run.token)
    run.extend(camera_findings(found))
    save_camera(name, found, run.folder)
    figures = camera_figures(found, sightings)
    run.finish(figures, verdict(found), lambda outcome: camera_report(name, found, sightings, outcome))
    return found


def _look(run: Run, images: Path, panels: Target, gates: Mapping[str, object], name: str) -> Sightings:
    """Find the target; what is found is kept for the next run, in a folder that was requested or beside a new one."""
    notes = Notes()
    run.gather(notes.findings)
    cache = DetectionCache(run.place.parent if run.is_new else run.place, panels, gates)
    with run.stage("images", count_images(images)) as show:
        read = run.until_cancelled(read_images(images, notes))
        found = find_targets(read, panels, gates, cache, camera=name, progress=show)
    cache.save(run.place.parent if run.is_new else run.folder)
    return found


def _table(value: object) -> Mapping[str, object]:
    return value if isinstance(value, Mapping) else {}

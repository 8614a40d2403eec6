"""The run of a map: a drive mapped, or mapped at known poses, into the folder of a run."""

from __future__ import annotations

from pathlib import Path

from groma.io.trajectory import read_tum
from groma.mapping.known_poses import survey
from groma.mapping.mapper import map_drive
from groma.mapping.result import MapResult
from groma.recordings.drive import Drive
from groma.report.map.figures import map_figures
from groma.report.map.report import map_report
from groma.report.map.words import verdict
from groma.runs.map_files import save_map, save_survey
from groma.runs.run import Run
from groma.runs.settings import Settings


def map_into(run: Run, drive: Drive, settings: Settings) -> MapResult:
    """Map a drive and finish the run with it.

    Raises
    ------
    EstimationError
        When there is no map.
    """
    run.settings = {"map": {**settings, "scans": drive.scans, "odometry": (drive.odometry or "none").partition(":")[0]}}
    run.gather(drive.findings)
    with run.stage("scans", _count(drive)) as show:

        def told(scans: int, keyframes: int, local_maps: int, closures: int) -> None:
            show(scans, f"{keyframes} keyframes, {local_maps} local maps, {closures} closures")

        result = map_drive(drive, settings, told, run.token)
    run.extend(result.findings)
    save_map(result, run.folder)
    run.finish(map_figures(result), verdict(result), lambda outcome: map_report(result, outcome))
    return result


def map_at_poses_into(run: Run, drive: Drive, settings: Settings, poses: Path) -> None:
    """Map landmarks and occupancy at known poses and finish the run with them.

    Raises
    ------
    EstimationError
        When no scan was taken at a known pose.
    """
    run.settings = {"map": settings}
    run.inputs["poses"] = poses
    run.gather(drive.findings)
    trajectory = read_tum(poses)
    result = survey(drive, trajectory, settings)
    run.extend(result.findings)
    save_survey(result, trajectory, run.folder)
    kinds, scans = result.landmarks.kinds.tolist(), result.counts["keyframes"]
    headline = f"{kinds.count('corner')} corners and {kinds.count('reflector')} reflectors from {scans} scans."
    run.finish({"counts": result.counts}, headline)


def _count(drive: Drive) -> int | None:
    return next((stream.count for stream in drive.recording.streams if stream.name == drive.scans), None)

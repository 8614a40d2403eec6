"""From a drive to a map: the Rust core fed with what comes, its arrays put into values."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping

import numpy as np

from groma import _core
from groma.errors import EstimationError, UserError
from groma.mapping.result import Closure, MapResult, PoseGraph, WeakSpot
from groma.nouns.findings import of_core
from groma.nouns.maps import Landmarks, OccupancyGrid
from groma.nouns.messages import JointState, LaserScan, Odometry
from groma.recordings.drive import Drive

Progress = Callable[[int, int, int, int], None]
"""Called with scans read, keyframes, local maps and closures."""
SHOWN_EVERY = 20
"""Scans between two calls of a progress."""

STREAMS: dict[str, object] = {"scans": "", "odometry": ""}
"""Settings that the core does not know: which streams of the recording are mapped; empty, chosen by the reader."""


def map_defaults() -> dict[str, object]:
    """Return all settings of `groma map` with their defaults."""
    return {**STREAMS, **json.loads(_core.map_defaults())}


def map_drive(
    drive: Drive,
    settings: Mapping[str, object],
    progress: Progress | None = None,
    token: _core.Token | None = None,
) -> MapResult:
    """Map a drive.

    Ctrl-C, or a cancelled token, ends the work with the map of what was read: the current graph.

    Parameters
    ----------
    drive
        Scans and odometry in the order in which they came.
    settings
        Those of ``groma config``; what is left out has its default.
    progress
        Called now and then.
    token
        Ends the work when it is cancelled.

    Raises
    ------
    UserError
        When a setting is unknown or out of range.
    EstimationError
        When no scan could be used or the pose graph cannot be solved.
    """
    options = {
        **json.loads(_core.map_defaults()),
        **{key: value for key, value in settings.items() if key not in STREAMS},
    }
    wanted = options["lateness"]
    if isinstance(wanted, int | float) and 0 <= wanted < drive.lateness:
        options["lateness"] = drive.lateness
    try:
        core = _machine(json.dumps(options), drive)
    except ValueError as error:
        raise UserError(f"setting of map: {error}") from error
    token = token or _core.Token()
    try:
        _feed(core, drive, progress, token)
    except KeyboardInterrupt:
        token.cancel()
    try:
        arrays = core.finish(token)
    except EstimationError as error:
        raise EstimationError(f"{drive.recording.path}: {error}") from error
    return to_result(arrays)


def _machine(options: str, drive: Drive) -> _core.Mapper:
    if drive.vehicle and drive.wheels:
        return _core.Mapper(options, drive.vehicle.laser, drive.vehicle.to_json(), drive.wheels.axle)
    return _core.Mapper(options, (drive.mount.x, drive.mount.y, drive.mount.yaw))


def _feed(core: _core.Mapper, drive: Drive, progress: Progress | None, token: _core.Token) -> None:
    scans = 0
    for event in drive.events():
        if token.cancelled:
            return
        if isinstance(event, Odometry):
            core.push_odometry(event.stamp, event.x, event.y, event.theta)
            continue
        if isinstance(event, JointState):
            if drive.wheels and (positions := drive.wheels.positions(event)):
                core.push_wheels(event.stamp, positions)
            continue
        core.push_scan(event.stamp, event.ranges, event.intensities, beams(event))
        scans += 1
        if progress and scans % SHOWN_EVERY == 0 and (state := core.state()):
            progress(scans, state.keyframes, state.local_maps, state.closures)


def beams(scan: LaserScan) -> tuple[float, float, float, float, float]:
    """Return the beam geometry of a scan as the core takes it."""
    g = scan.geometry
    return (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)


def to_result(arrays: _core.MapArrays) -> MapResult:
    """Return the core's arrays as a value."""
    trajectory = arrays.trajectory
    odometry = arrays.odometry
    closures = _closures(arrays)
    return MapResult(
        graph=_graph(arrays.graph),
        trajectory_stamps=arrays.trajectory_stamps,
        trajectory=trajectory,
        odometry=odometry if len(odometry) else np.full_like(trajectory, np.nan),
        tracked=arrays.tracked,
        closures=closures,
        grid=to_grid(arrays.grid),
        landmarks=to_landmarks(arrays.landmarks),
        weak=tuple(WeakSpot(a, b, (x, y), sigma, direction, why) for a, b, x, y, sigma, direction, why in arrays.weak),
        counts=arrays.counts,
        findings=of_core(arrays.findings),
        verdict=arrays.verdict,
    )


def to_grid(arrays: _core.GridArrays) -> OccupancyGrid:
    """Return the core's grid as a value."""
    return OccupancyGrid(arrays.resolution, arrays.origin, arrays.cells)


def to_landmarks(arrays: _core.LandmarkArrays) -> Landmarks:
    """Return the core's landmarks as a value."""
    return Landmarks(
        kinds=np.array(arrays.kinds, dtype=np.str_),
        positions=arrays.positions,
        covariances=arrays.covariances,
        orientations=arrays.orientations,
        descriptors=arrays.descriptors,
        seen=arrays.seen,
        visible=arrays.visible,
    )


def _graph(arrays: _core.GraphArrays) -> PoseGraph:
    return PoseGraph(
        stamps=arrays.stamps,
        poses=arrays.poses,
        covariances=arrays.covariances,
        pairs=arrays.pairs,
        measurements=arrays.measurements,
        information=arrays.information,
        kinds=tuple(arrays.kinds),
        chi_squares=arrays.chi_squares,
    )


def _closures(arrays: _core.MapArrays) -> tuple[Closure, ...]:
    stamps, poses = arrays.graph.stamps, arrays.graph.poses
    out = []
    for row, reason in zip(arrays.closures, arrays.verdicts, strict=True):
        a, b = int(row[0]), int(row[1])
        out.append(
            Closure(
                from_stamp=float(stamps[a]),
                to_stamp=float(stamps[b]),
                from_xy=(float(poses[a, 0]), float(poses[a, 1])),
                to_xy=(float(poses[b, 0]), float(poses[b, 1])),
                accepted=not reason,
                reason=reason,
                overlap=float(row[2]),
                correction_m=float(row[3]),
                residual_m=float(row[4]),
                residual_rad=float(row[5]),
            )
        )
    return tuple(out)

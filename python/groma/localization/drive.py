"""From a drive and a map to poses in the map: messages given to the core, one by one, in the order of their arrival.

What is computed and how stands in the crate ``pipeline`` (``localize``);
:class:`groma.localization.localizer.Localizer` is the filter inside for those who have motions and observations of
their own.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from groma import _core
from groma.errors import EstimationError, UserError
from groma.io.streams import Kind
from groma.localization.options import LocalizeOptions
from groma.localization.result import Halt, Localized, Weak
from groma.mapping.mapper import beams, to_landmarks
from groma.nouns.findings import of_core
from groma.nouns.maps import Chart, landmark_rows
from groma.nouns.messages import JointState, Odometry
from groma.nouns.poses import Pose
from groma.nouns.vehicle import Vehicle
from groma.recordings.drive import Drive

Progress = Callable[[int, str, float], None]
"""Called with scans read, status and standard deviation of the position [m]."""


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be done with a drive."""

    chart: Chart
    options: LocalizeOptions
    start: Pose | None = None
    """``T_map_base`` as x, y [m], theta [rad]; None when it is not known."""


def localize_defaults() -> LocalizeOptions:
    """Return the default settings of :func:`localize_drive`."""
    return cast(LocalizeOptions, json.loads(_core.localize_defaults()))


def localize_drive(drive: Drive, request: Request, progress: Progress | None = None) -> Localized:
    """Localize a drive.

    Parameters
    ----------
    drive
        Scans, and odometry or the readings of a vehicle's wheels, in the order in which they came.
    request
        Map, start and settings.
    progress
        Called after every scan.

    Raises
    ------
    UserError
        When a setting is out of range, or the recording has neither odometry nor readings of wheels.
    EstimationError
        When no scan could be used.
    """
    if drive.vehicle is None and drive.odometry is None:
        raise UserError(f"{drive.recording.path}: no odometry in it: give a --vehicle, or record odometry")
    if drive.wheels and drive.wheels.kind is not Kind.JOINTS:
        raise UserError(f"{drive.recording.path}: no joint states in it: without them a vehicle file is of no use")
    wanted = request.options.get("lateness", 0.0)
    waiting = request.options | {"lateness": max(wanted, drive.lateness) if wanted >= 0 else wanted}
    core = localizing(replace(request, options=waiting), (drive.mount.x, drive.mount.y, drive.mount.yaw), drive.vehicle)
    _feed(core, drive, progress)
    try:
        found = core.finish()
    except RuntimeError as error:
        raise EstimationError(f"{drive.recording.path}: {error}") from error
    return to_localized(found, request.chart)


def localizing(request: Request, mount: Pose, vehicle: Vehicle | None = None) -> _core.Localize:
    """Return the machine that localizes a drive, before its first message.

    Parameters
    ----------
    request
        Map, start and settings.
    mount
        ``T_base_laser`` where there is no vehicle.
    vehicle
        What drives, where its wheels are read.

    Raises
    ------
    UserError
        When a setting is out of range, or map or start cannot be used.
    """
    chart = request.chart
    grid = chart.grid
    walls = None if grid is None else (grid.resolution, grid.origin, np.ascontiguousarray(grid.cells))
    begin = None if request.start is None else (request.start, None)
    options, row = json.dumps(request.options), None if vehicle is None else vehicle.to_json()
    try:
        return _core.Localize(
            *landmark_rows(chart.landmarks), walls, begin, vehicle.laser if vehicle else mount, row, options, None
        )
    except ValueError as error:
        raise UserError(f"setting of localize: {error}") from error


def _feed(core: _core.Localize, drive: Drive, progress: Progress | None) -> None:
    scans = 0
    for event in drive.events():
        if isinstance(event, JointState):
            if drive.wheels and (positions := drive.wheels.positions(event)):
                core.push_wheels(event.stamp, positions)
        elif isinstance(event, Odometry):
            core.push_odometry(event.stamp, (event.x, event.y, event.theta))
        else:
            core.push_scan(event.stamp, event.ranges, event.intensities, beams(event))
            scans += 1
            state = core.state() if progress else None
            if progress and state:
                progress(scans, state[3].status, state[3].sigma_position)


def to_localized(found: _core.LocalizedDrive, chart: Chart) -> Localized:
    """Return the core's arrays as a value."""
    return Localized(
        chart=chart,
        stamps=found.stamps,
        poses=found.poses,
        covariances=found.covariances,
        status=np.array(found.status, dtype=np.str_),
        observed=found.observed,
        matched=found.matched,
        nis=found.nis,
        dof=found.dof,
        sigma_position=found.sigma_position,
        sigma_heading=found.sigma_heading,
        geometry=found.geometry,
        way=found.distance,
        extrapolated=found.extrapolated,
        corrected=found.corrected,
        used=found.used,
        halts=tuple(Halt(*row) for row in found.halts),
        weak=tuple(Weak(*row) for row in found.weak),
        seen=None if found.seen is None else to_landmarks(found.seen),
        counts={name: float(count) for name, count in found.counts},
        findings=of_core(found.findings),
    )

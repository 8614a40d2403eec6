"""A map result as a recording for the rerun viewer (rerun.io): the map, the drives, closures and landmarks, z = 0.

The pose of the vehicle and the drift run over the timeline `stamp`; everything else stands still. Unlike the files of
`io`, an .rrd holds the time at which it was made, so its bytes differ from run to run.

Source: the Python SDK of rerun, ref.rerun.io/docs/python. The package is an extra of groma because of its size.
"""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

import numpy as np

from groma.errors import UserError
from groma.mapping.result import MapResult
from groma.nouns.arrays import Array
from groma.nouns.maps import OccupancyGrid
from groma.nouns.poses import quaternions_of
from groma.report.drawing import ACCEPTED, FINAL, INK, ODOMETRY, REJECTED, TRACKED, WEAK
from groma.report.map.figures import accepted, drift, rejected


def save_rrd(result: MapResult, path: Path) -> None:
    """Write a result as an .rrd file.

    Raises
    ------
    UserError
        When rerun-sdk is not installed, or the file cannot be written.
    """
    rr = load_rerun()
    beside = path.with_name(f".{path.name}.part")
    try:
        with rr.RecordingStream("groma_map", recording_id="groma_map") as recording:
            recording.save(beside)
            _log(rr, recording, result)
            recording.disconnect()
        os.replace(beside, path)
    except OSError as error:
        raise UserError(f"{path}: cannot be written ({error.strerror or error})") from error
    finally:
        beside.unlink(missing_ok=True)


def load_rerun() -> Any:
    """Return the package `rerun`; call it before the work, so that its absence shows at once.

    Raises
    ------
    UserError
        When it is not installed, or another package has its name.
    """
    try:
        module = importlib.import_module("rerun")
    except ModuleNotFoundError as error:
        raise UserError("--rerun needs rerun-sdk: pip install 'groma[rerun]'") from error
    if not hasattr(module, "RecordingStream"):
        raise UserError("--rerun needs rerun-sdk, but another package is called rerun: pip install 'groma[rerun]'")
    return module


def _log(rr: Any, recording: Any, result: MapResult) -> None:
    def still(entity: str, value: object) -> None:
        recording.log(entity, value, static=True)

    still("map", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    still(
        "map/walls",
        rr.Points3D(_flat(occupied_centres(result.grid)), colors=_rgba(INK), radii=result.grid.resolution / 2),
    )
    drives = {"final": (result.trajectory, FINAL), "tracked": (result.tracked, TRACKED)}
    for name, (poses, colour) in (drives | {"odometry": (result.odometry, ODOMETRY)}).items():
        known = poses[np.isfinite(poses).all(axis=1)]
        still(f"map/drive/{name}", rr.LineStrips3D([_flat(known[:, :2])] if len(known) else [], colors=_rgba(colour)))
    for name, group, colour in (
        ("accepted", accepted(result), ACCEPTED),
        ("rejected", rejected(result), REJECTED),
    ):
        strips = [_flat(np.array([closure.from_xy, closure.to_xy])) for closure in group]
        still(f"map/closures/{name}", rr.LineStrips3D(strips, colors=_rgba(colour)))
    still("map/landmarks", rr.Points3D(_flat(result.landmarks.positions), colors=_rgba(ACCEPTED)))
    spots = np.array([spot.xy for spot in result.weak]).reshape(-1, 2)
    still("map/weak", rr.Points3D(_flat(spots), colors=_rgba(WEAK), labels=[spot.why for spot in result.weak]))
    _log_over_time(rr, recording, result)


def _log_over_time(rr: Any, recording: Any, result: MapResult) -> None:
    quaternions = quaternions_of(result.trajectory[:, 2])
    stamps = [rr.TimeColumn("stamp", timestamp=result.trajectory_stamps)]
    poses = rr.Transform3D.columns(translation=_flat(result.trajectory[:, :2]), quaternion=quaternions)
    recording.log("map/base_link", rr.TransformAxes3D(axis_length=0.5), static=True)
    recording.send_columns("map/base_link", indexes=stamps, columns=poses)
    for name, other in (("tracked", result.tracked), ("odometry", result.odometry)):
        values = rr.Scalars.columns(scalars=drift(other, result.trajectory))
        recording.send_columns(f"drift/{name}", indexes=stamps, columns=values)


def occupied_centres(grid: OccupancyGrid) -> Array:
    """Return the centres (N, 2) of the occupied cells [m]."""
    row, column = np.nonzero(grid.cells >= 65)
    centres: Array = np.array(grid.origin) + (np.column_stack([column, row]) + 0.5) * grid.resolution
    return centres


def _rgba(colour: str) -> int:
    """Return `#rrggbb` as the number that rerun takes for an opaque colour."""
    return int(colour[1:], 16) << 8 | 0xFF


def _flat(xy: Array) -> Array:
    return np.column_stack([xy, np.zeros(len(xy))])

"""A building's cameras, mapped with a robot that carries a target: the core in numpy terms.

Messages are pushed in any order, late or twice; the same set of messages gives the same map. Poses ``T_a_b`` are rows
``x y z qx qy qz qw``. The frame W (`map`) has its origin on the floor under the robot's first stop, x forward there,
z up. Camera frames are optical: z ahead, x right, y down. Covariances of poses are 6 x 6 in the order x, y, z, rot x,
rot y, rot z, all in the axes of W, the rotation about the camera's own centre. Theory: docs/theory/camera_network.md.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from groma import _core
from groma.errors import EstimationError, UserError
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.findings import of_core
from groma.nouns.messages import Odometry
from groma.nouns.network import KnownCamera, MappedCamera, NetworkMap, Views
from groma.nouns.target import Target


def network_defaults() -> dict[str, object]:
    """Return all settings of `groma cameras map` with their defaults."""
    defaults: dict[str, object] = json.loads(_core.network_defaults())
    return defaults


class NetworkMapper:
    """Maps a network from messages; `finish` may be called at any time, and again after more messages.

    Parameters
    ----------
    target
        The panels, in the frame of the robot.
    cameras
        The cameras, with what is known of their lenses.

    Raises
    ------
    UserError
        When the target makes no sense, a covariance has the wrong size, or two cameras have one name.
    """

    def __init__(self, target: Target, cameras: Sequence[KnownCamera]) -> None:
        self._names = {known.name: k for k, known in enumerate(cameras)}
        if len(self._names) < len(cameras):
            raise UserError("two cameras have the same name: give each its own")
        self._panels = {panel.name: k for k, panel in enumerate(target.panels)}
        self._counts: Counter[str] = Counter()
        known = [(c.name, c.camera.json(), c.covariance) for c in cameras]
        try:
            self._core = _core.NetworkSurvey(target.json(), known)
        except ValueError as error:
            raise UserError(str(error)) from error

    def push(self, message: Odometry | Detection, stop: int | None = None) -> None:
        """Take a message, in any order; one that makes no sense is counted and left out.

        Parameters
        ----------
        message
            A pose of the odometry, or corners of one panel in one image.
        stop
            Number of the stop at which the image was taken, when it is known; else the odometry tells.
        """
        if isinstance(message, Odometry):
            taken = self._core.push_odometry(message.stamp, message.x, message.y, message.theta)
            self._counts["odometry read" if taken else "left out: odometry that is not finite"] += 1
            return
        camera, panel = self._names.get(message.camera), self._panels.get(message.panel)
        if camera is None or panel is None:
            what = f"camera {message.camera}" if camera is None else f"panel {message.panel}"
            self._counts[f"left out: detections of an unknown {what}"] += 1
            return
        pixels = np.ascontiguousarray(message.pixels, dtype=np.float64).reshape(-1, 2)
        ids = np.ascontiguousarray(message.corners, dtype=np.int64)
        sigma = np.ascontiguousarray(message.sigma, dtype=np.float64)
        taken = self._core.push_detection(message.stamp, camera, panel, stop, ids, pixels, sigma)
        self._counts["detections read" if taken else "left out: detections that make no sense"] += 1

    def finish(self, settings: Mapping[str, object] | None = None, *, token: _core.Token | None = None) -> NetworkMap:
        """Return the map of all that came so far.

        Parameters
        ----------
        settings
            Those of :func:`network_defaults`; what is left out has its default.
        token
            Ends the work when it is cancelled.

        Raises
        ------
        UserError
            When a setting is unknown or out of range.
        EstimationError
            When the messages do not allow a map.
        KeyboardInterrupt
            When the token was cancelled.
        """
        try:
            arrays = self._core.finish(json.dumps(settings or {}), token)
        except ValueError as error:
            raise UserError(f"setting of cameras: {error}") from error
        except RuntimeError as error:
            raise EstimationError(str(error)) from error
        return _network(arrays, tuple(self._names), dict(self._counts))


def _network(arrays: _core.NetworkArrays, names: tuple[str, ...], counts: dict[str, float]) -> NetworkMap:
    cameras = tuple(_cameras(arrays, names))
    seen = {camera.name for camera in cameras}
    heads = arrays.views
    views = Views(
        stops=heads[:, 0],
        cameras=heads[:, 1],
        places=heads[:, 2],
        nis=arrays.nis,
        verdicts=tuple(arrays.verdicts),
        used=arrays.used,
        chi_squares=arrays.view_chi,
    )
    return NetworkMap(
        cameras=cameras,
        unseen=tuple(name for name in names if name not in seen),
        joint=arrays.joint,
        halt_stamps=arrays.halt_stamps,
        odometry=arrays.odometry,
        stop_halts=arrays.stop_halts,
        stops=arrays.stops,
        stop_covariances=arrays.stop_covariances,
        mount=arrays.mount[0],
        mount_covariance=arrays.mount_covariance[0],
        views=views,
        moved=tuple((names[camera], int(old), int(new)) for camera, old, new in arrays.moved),
        slipped=arrays.slip,
        residuals={kind: (chi, n) for kind, (chi, n) in arrays.residuals},
        corner_chi_square=_number(arrays.corner_chi_square),
        height_sigma=arrays.height_sigma,
        odometry_error=_number(arrays.odometry_error),
        path_length=arrays.path_length,
        steps=arrays.steps[0],
        converged=arrays.steps[1],
        findings=of_core(arrays.findings),
        counts=counts,
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _cameras(arrays: _core.NetworkArrays, names: tuple[str, ...]) -> list[MappedCamera]:
    found = []
    for k, (camera, since, current, views) in enumerate(arrays.camera_heads):
        found.append(
            MappedCamera(
                name=names[camera],
                pose=arrays.cameras[k],
                covariance=arrays.covariances[k],
                camera=msgspec.json.decode(arrays.intrinsics[k], type=Camera),
                intrinsics_covariance=arrays.intrinsics_covariances[k],
                views=int(views),
                chi_square_per_dof=float(arrays.camera_chi[k]),
                since=float(arrays.halt_stamps[since]),
                current=bool(current),
            )
        )
    return found


@dataclass(frozen=True, slots=True)
class Placed:
    """A fixed camera and the target on the robot, from known poses of the robot."""

    camera: Array
    """(7,) ``T_world_camera``."""
    mount: Array
    """(7,) ``T_base_target``."""
    intrinsics: Camera
    """Those of the camera, changed as far as its covariance allows."""
    rms: float
    """Of the corners' coordinates [pixel]."""
    covariance: Array
    """(12, 12) of the errors of camera and mount on the left, over the directions that are held, for corners with a
    standard deviation of one pixel."""
    planar: bool
    """Whether the robot moved in the plane: then the height of the target is the one given."""
    weak: tuple[str, ...]
    """What the data do not tell, in words."""


def place_by_poses(
    known: KnownCamera, target: Target, poses: Array, detections: Sequence[Sequence[Detection]], height: float = 0.0
) -> Placed:
    """Find a fixed camera and the place of a target on a robot (robot-world / hand-eye).

    Parameters
    ----------
    known
        The camera; its parameters are estimated too as far as their covariance allows, not at all without one.
    target
        The panels in a frame of the target, whose place on the robot is not known.
    poses
        (N, 7) ``T_world_base``.
    detections
        N times what the camera saw there.
    height
        Of the target on the robot [m], for a robot that moves in the plane and cannot tell it.

    Raises
    ------
    EstimationError
        With fewer than three views, or a robot that never turns.
    """
    names = [panel.name for panel in target.panels]
    all_ = [(k, detection) for k, group in enumerate(detections) for detection in group]
    heads = np.array([[k, names.index(d.panel), len(d.corners)] for k, d in all_], dtype=np.int64).reshape(-1, 3)
    ids = np.concatenate([np.empty(0, np.int64), *(d.corners for _, d in all_)])
    pixels = np.concatenate([np.empty((0, 2)), *(np.reshape(d.pixels, (-1, 2)) for _, d in all_)])
    rows = np.asarray(poses, dtype=np.float64).reshape(-1, 7)
    exact = np.zeros((len(known.camera.parameters),) * 2)
    spread = exact if known.covariance is None else known.covariance
    try:
        found = _core.place_by_poses(known.camera.json(), spread, target.json(), rows, heads, ids, pixels, 1.0, height)
    except RuntimeError as error:
        raise EstimationError(str(error)) from error
    return Placed(
        camera=found.camera[0],
        mount=found.mount[0],
        intrinsics=msgspec.json.decode(found.intrinsics, type=Camera),
        rms=found.rms,
        covariance=found.covariance[:12, :12],
        planar=found.planar,
        weak=tuple(found.weak),
    )

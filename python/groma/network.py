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
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.camera import Camera
from groma.detection import Detection
from groma.errors import EstimationError, UserError
from groma.findings import Finding, of_core
from groma.models import Odometry
from groma.target import Target

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class KnownCamera:
    """What is known of a camera before the survey."""

    name: str
    camera: Camera
    covariance: Array | None = None
    """Of its parameters; None when it is not known: then its focal length is taken as uncertain by `focal`."""


@dataclass(frozen=True, slots=True)
class MappedCamera:
    """Where a camera is, and what is known of it."""

    name: str
    pose: Array
    """(7,) ``T_map_camera``."""
    covariance: Array
    """(6, 6)."""
    camera: Camera
    """Its intrinsics after the survey."""
    intrinsics_covariance: Array
    """(p, p) of its parameters."""
    views: int
    """Views that hold it."""
    chi_square_per_dof: float
    """Of its corners: near 1 when its lens and the target are as described."""
    since: float
    """Stamp of the stop from which on it is there [s]."""
    current: bool
    """False for a place that the camera has left."""


@dataclass(frozen=True, slots=True)
class Views:
    """All views, and what became of them."""

    stops: Integers
    """(V,) number of the halt."""
    cameras: Integers
    """(V,) number of the camera."""
    places: Integers
    """(V,) index of the mapped camera; -1 for none."""
    nis: Array
    """(V,) squared Mahalanobis distance of the innovation, 6 degrees of freedom; 0 for a first sight."""
    verdicts: tuple[str, ...]
    """V of: first sight, taken, rejected, undecided, no pose."""
    used: Integers
    """(U,) those that the map rests on."""
    chi_squares: Array
    """(U, 2) sum of squares of their corners in standard deviations, and the number of coordinates."""


@dataclass(frozen=True, slots=True)
class NetworkMap:
    """Everything that `groma cameras map` writes."""

    cameras: tuple[MappedCamera, ...]
    """In the order in which they were first seen; a camera that was moved is there twice."""
    unseen: tuple[str, ...]
    """Cameras that never saw the target well enough to be placed."""
    joint: Array | None
    """(6 K, 6 K) joint covariance of all of them; None for a large network."""
    halt_stamps: Array
    """(H,) stamps of all stops."""
    odometry: Array
    """(H, 3) odometry alone at the stops, from the first."""
    stop_halts: Integers
    """(S,) the stops that hold the map."""
    stops: Array
    """(S, 7) ``T_map_base`` there."""
    stop_covariances: Array
    """(S, 6, 6)."""
    mount: Array
    """(7,) what is to be put before the poses of the target file: ``T_base_target``."""
    mount_covariance: Array
    """(6, 6) of its error on the left; zero in directions that were taken as given."""
    views: Views
    moved: tuple[tuple[str, int, int], ...]
    """Name, index of the old and of the new place of cameras that were moved."""
    slipped: int
    """Cameras that seem moved when it must be the odometry that slipped; 0 otherwise."""
    residuals: Mapping[str, tuple[float, int]]
    """Sum of squares in standard deviations and number, of corners, odometry, floor and priors."""
    corner_chi_square: float
    """Of all corners per degree of freedom: near 1 the stated sigmas are honest; NaN without any."""
    height_sigma: float
    """Of the height that all cameras share with the target on the robot [m]; 0 where it was taken as given."""
    odometry_error: float
    """How far odometry alone ends from the last stop of the map [m]; NaN without a map."""
    path_length: float
    """Of the straight lines from stop to stop, by odometry [m]."""
    steps: int
    converged: bool
    findings: tuple[Finding, ...] = ()
    """What the core noticed, the weightiest first."""
    counts: Mapping[str, float] = field(default_factory=dict)
    """Messages read and left out."""


def network_defaults() -> dict[str, object]:
    """Return all settings of `groma cameras map` with their defaults."""
    return _core.network_defaults()


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


def _network(arrays: dict[str, Any], names: tuple[str, ...], counts: dict[str, float]) -> NetworkMap:
    cameras = tuple(_cameras(arrays, names))
    seen = {camera.name for camera in cameras}
    heads = arrays["views"]
    views = Views(
        stops=heads[:, 0],
        cameras=heads[:, 1],
        places=heads[:, 2],
        nis=arrays["nis"],
        verdicts=tuple(arrays["verdicts"]),
        used=arrays["used"],
        chi_squares=arrays["view_chi"],
    )
    return NetworkMap(
        cameras=cameras,
        unseen=tuple(name for name in names if name not in seen),
        joint=arrays["joint"],
        halt_stamps=arrays["halt_stamps"],
        odometry=arrays["odometry"],
        stop_halts=arrays["stop_halts"],
        stops=arrays["stops"],
        stop_covariances=arrays["stop_covariances"],
        mount=arrays["mount"][0],
        mount_covariance=arrays["mount_covariance"][0],
        views=views,
        moved=tuple((names[camera], int(old), int(new)) for camera, old, new in arrays["moved"]),
        slipped=arrays["slip"],
        residuals={kind: (chi, n) for kind, (chi, n) in arrays["residuals"]},
        corner_chi_square=_number(arrays["corner_chi_square"]),
        height_sigma=arrays["height_sigma"],
        odometry_error=_number(arrays["odometry_error"]),
        path_length=arrays["path_length"],
        steps=arrays["steps"][0],
        converged=arrays["steps"][1],
        findings=of_core(arrays["findings"]),
        counts=counts,
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _cameras(arrays: dict[str, Any], names: tuple[str, ...]) -> list[MappedCamera]:
    found = []
    for k, (camera, since, current, views) in enumerate(arrays["camera_heads"]):
        found.append(
            MappedCamera(
                name=names[camera],
                pose=arrays["cameras"][k],
                covariance=arrays["covariances"][k],
                camera=msgspec.json.decode(arrays["intrinsics"][k], type=Camera),
                intrinsics_covariance=arrays["intrinsics_covariances"][k],
                views=int(views),
                chi_square_per_dof=float(arrays["camera_chi"][k]),
                since=float(arrays["halt_stamps"][since]),
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
        camera=found["camera"][0],
        mount=found["mount"][0],
        intrinsics=msgspec.json.decode(found["intrinsics"], type=Camera),
        rms=found["rms"],
        covariance=found["covariance"][:12, :12],
        planar=found["planar"],
        weak=tuple(found["weak"]),
    )


def rotation_matrix(quaternion: Array) -> Array:
    """Return the (3, 3) matrix of a unit quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )

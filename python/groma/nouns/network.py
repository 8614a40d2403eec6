"""The map of a camera network: values only, ready to be written, drawn or evaluated.

Poses ``T_a_b`` are rows ``x y z qx qy qz qw``. The frame `map` has its origin on the floor under the robot's first
stop, x forward there, z up. Camera frames are optical: z ahead, x right, y down. Covariances of poses are 6 x 6 in the
order x, y, z, rot x, rot y, rot z, all in the axes of `map`, the rotation about the camera's own centre.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from groma.nouns.arrays import Array, Integers
from groma.nouns.camera import Camera
from groma.nouns.findings import Finding


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
    """Of all corners per degree of freedom: near 1 the stated sigmas are consistent; NaN without any."""
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

"""What to drive before one camera: the next best drive of a robot with panels, and common trajectories.

The floor is z = 0, its origin the foot of the camera, x the direction in which it looks, y to the left. The estimators
are in the core; formulas, sources and what is left out: docs/theory/planning.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from groma import _core
from groma.cameras.calibration import flat_corners
from groma.errors import UserError
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.poses import rotation_matrix
from groma.nouns.target import Target
from groma.planning.core_calls import call, to_json
from groma.planning.exploration import Noise

MOTIONS = ("stationary", "one-panel", "three-panels", "rotation", "square", "star")
"""Common trajectories."""


class Search(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"lambda_": "lambda"}):
    """Where and for how long to look for drives."""

    target: float
    """Worst standard deviation of a pixel to reach [pixel]."""
    depth: tuple[float, float]
    """Nearest and farthest distance from the camera that the robot may have, along its view [m]."""
    side: float
    """Farthest to either side [m]."""
    lambda_: float
    """Metres of driving traded for one square metre less of variance in the map [1/m]."""
    drives: int
    """Most drives."""
    noise: Noise
    """What odometry loses."""


class Tries(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How a drive is tried out."""

    runs: int
    views: int
    """Most panels in images that are used."""
    seed: int


class Sitting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How one panel, 0.6 m wide, is held before a camera."""

    views: int
    """Number of images."""
    tilt: float
    """Angle between the normal of the panel and the axis of the camera [rad]."""
    distance: float
    """Of its middle, along the axis [m]."""
    grid: int
    """Tags in a row and in a column."""
    coverage: float
    """Share of width and height of the image in which its middle is seen."""


class _Defaults(msgspec.Struct, frozen=True):
    search: Search
    tries: Tries
    camera: Camera
    target: Target
    corner: float
    sitting: Sitting


DEFAULTS = msgspec.json.decode(_core.camera_plan_defaults(), type=_Defaults)


class Stage(msgspec.Struct, frozen=True):
    """A camera on its mount, and the panels on the robot before it.

    Examples
    --------
    >>> plan_camera(Stage(mount(2.0, 0.43)), (2.6, 0.0, 3.14159)).met
    True
    """

    mount: tuple[float, ...]
    """``T_floor_camera``: position [m], then x, y, z, w. See :func:`mount`."""
    camera: Camera = DEFAULTS.camera
    """As far as it is known: nominal intrinsics do."""
    target: Target = DEFAULTS.target
    """The panels, in the frame of the robot."""
    corner: float = DEFAULTS.corner
    """Standard deviation of a corner's coordinate [pixel]."""


class Stop(msgspec.Struct, frozen=True):
    """A pose at which the camera looks, and what is known then."""

    pose: tuple[float, float, float]
    """x, y [m], heading [rad] of the robot."""
    leg: int
    """Number of the drive: a turn, a straight line, a turn."""
    views: int
    """Panels seen."""
    worst: float
    """Worst standard deviation of a pixel [pixel]."""
    length: float
    """Distance so far [m]."""
    effort: float
    """What the wheels drove so far, turns included [m]."""
    variance: float
    """Variance of the camera's place in the map that odometry added so far [m^2]."""


class CameraPlan(msgspec.Struct, frozen=True):
    """The next best drives."""

    stops: tuple[Stop, ...]
    """The start, then every view on the way."""
    met: bool
    """Whether the worst pixel is as good as required."""
    before: list[list[float]]
    """(n, n) covariance of the parameters before the first look."""
    after: list[list[float]]
    """(n, n) after the last."""
    seen: int
    """Panels in detections that were given."""
    worst_before: float
    """Worst standard deviation of a pixel before the first look [pixel]."""

    @property
    def end(self) -> Stop:
        """The last stop."""
        return self.stops[-1]

    @property
    def looks(self) -> int:
        """Number of stops at which a panel is seen anew; at the others the camera need not look."""
        return sum(stop.views > 0 for stop in self.stops)

    @property
    def poses(self) -> Array:
        """The poses (n, 3) at which the camera looks."""
        return np.array([stop.pose for stop in self.stops])


class Judged(msgspec.Struct, frozen=True):
    """A common trajectory, and what it gives from nominal intrinsics on."""

    motion: str
    shown: Target
    """The panels as it shows them: on the left side of the robot where it drives across the view."""
    stops: tuple[tuple[float, float, float], ...]
    length: float
    effort: float
    variance: float
    views: int
    """Panels seen in all."""
    worst: float
    """Worst standard deviation of a pixel [pixel]."""
    sigmas: tuple[float, ...] | None
    """Of the parameters from the views alone; None when they do not determine a direction."""
    degenerate: bool
    """Whether a calibration from these views would be refused."""


class Tried(msgspec.Struct, frozen=True):
    """What calibrations from drawn corners of a drive gave."""

    mean: tuple[float, ...]
    """Of every parameter; empty when less than two were calibrated."""
    deviation: tuple[float, ...]
    predicted: tuple[float, ...] | None
    """Standard deviations that the views promise; None when they do not determine a direction."""
    worst: float | None
    """Worst standard deviation of a pixel over the trials [pixel]; None of less than two."""
    worst_predicted: float | None
    """The same as the views promise."""
    views: int
    refused: int
    reason: str | None
    """Why the last was refused."""


class Studied(msgspec.Struct, frozen=True):
    """What calibrations of a held panel gave, and what the views promised; None when all were refused."""

    focal: float | None
    """Root mean square error of fx, as a share of it."""
    focal_promised: float | None
    worst: float | None
    """Worst pixel by the errors: root mean square in its worst direction [pixel]."""
    worst_promised: float | None
    calibrated: int
    refused: int


def mount(height: float, down: float) -> tuple[float, ...]:
    """Return ``T_floor_camera`` of a camera at a height [m], pitched down [rad], level across.

    Raises
    ------
    UserError
        When it does not look forward.
    """
    return call(lambda: tuple(_core.camera_mount(height, down)))


def plan_camera(
    stage: Stage,
    start: tuple[float, float, float],
    search: Search = DEFAULTS.search,
    *,
    along: Sequence[tuple[float, float, float]] | None = None,
    covariance: Array | None = None,
    seen: Sequence[Detection] = (),
    looked: Sequence[tuple[float, float, float]] = (),
    token: _core.Token | None = None,
) -> CameraPlan:
    """Find the drives that make projections as certain as required, each the best for what it costs.

    Parameters
    ----------
    stage
        What is there.
    start
        Where the robot stands: x, y [m], heading [rad].
    search
        The goal, the floor, what odometry loses.
    along
        A drive of one's own instead, as poses to turn and drive to: what it gives is told, wherever it leads.
    covariance
        (n, n) of the camera's parameters, when it was calibrated before; without it they are taken as nominal.
    seen
        What this camera saw of the panels since.
    looked
        Poses of the robot from which it did: what it would see from there again adds nothing.
    token
        Cancels the work; KeyboardInterrupt tells so.

    Raises
    ------
    UserError
        When a number is out of range, or the robot starts where it may not be.
    """
    rows = None if covariance is None else np.asarray(covariance).tolist()
    known = to_json({"covariance": rows, "views": [len(d.corners) for d in seen], "looked": list(looked)})
    points, pixels, sigmas = flat_corners(stage.target, seen)
    request, poses = (to_json(stage), start), None if along is None else [(x, y, theta) for x, y, theta in along]
    for pose in (start, *(poses or ())):
        if not all(map(math.isfinite, pose)):
            raise UserError(f"a pose is {pose}: must be finite")
    found = call(lambda: _core.camera_plan(*request, poses, to_json(search), known, points, pixels, sigmas, token))
    return msgspec.json.decode(found, type=CameraPlan)


def ranked(stage: Stage, distance: float, noise: Noise = DEFAULTS.search.noise) -> tuple[Judged, ...]:
    """Judge common trajectories, their middle at a distance before the camera [m]: the best pixel first.

    Raises
    ------
    UserError
        When a number is out of range.
    """
    found = call(lambda: _core.camera_ranking(to_json(stage), distance, to_json(noise)))
    return msgspec.json.decode(found, type=tuple[Judged, ...])


def try_motion(
    stage: Stage,
    motion: str,
    distance: float,
    tries: Tries = DEFAULTS.tries,
    token: _core.Token | None = None,
) -> Tried:
    """Calibrate from drawn corners of a common trajectory, as often as requested, until the token is cancelled.

    Raises
    ------
    UserError
        When there is no such drive, or a number is out of range.
    """
    if motion not in MOTIONS:
        raise UserError(f"no drive is called {motion!r}: there are {', '.join(MOTIONS)}")
    return msgspec.json.decode(
        call(lambda: _core.camera_trials(to_json(stage), motion, distance, to_json(tries), token)), type=Tried
    )


def study_sitting(
    sitting: Sitting = DEFAULTS.sitting, tries: Tries = DEFAULTS.tries, token: _core.Token | None = None
) -> Studied:
    """Calibrate from drawn corners of a panel held before a camera, each time anew, until the token is cancelled.

    Raises
    ------
    UserError
        When a number is out of range.
    """
    return msgspec.json.decode(call(lambda: _core.camera_study(to_json(sitting), to_json(tries), token)), type=Studied)


def middle_of_view(stage: Stage, search: Search = DEFAULTS.search) -> float:
    """Return how far before the camera its axis passes the middle of the panels, within the floor of the search [m]."""
    ahead, _, up = rotation_matrix(np.array(stage.mount[3:]))[:, 2]
    drop = stage.mount[2] - middle_height(stage.target)
    near, far = search.depth
    distance = drop * ahead / -up if up < 0 < ahead else far
    return min(max(distance, near), far)


def middle_height(target: Target) -> float:
    """Return how high the middles of the panels are above the floor, on average [m]."""
    heights = []
    for panel in target.panels:
        up = rotation_matrix(np.array(panel.quaternion))[2]
        heights.append(panel.position[2] + float(up @ panel.corners.mean(axis=0)))
    return sum(heights) / len(heights)

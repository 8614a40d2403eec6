"""What to drive before one camera: the next best drive of a robot with panels, and the drives that people use.

The floor is z = 0, its origin the foot of the camera, x the direction in which it looks, y to the left. The estimators
are in the core; formulas, sources and what is left out: docs/theory/planning.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.camera import Camera
from groma.camera_calibration import flat_corners
from groma.detection import Detection
from groma.errors import UserError
from groma.exploration import Noise
from groma.target import Target

Array = NDArray[np.float64]
T = TypeVar("T")

MOTIONS = ("stationary", "one-panel", "three-panels", "rotation", "square", "star")
"""The drives that people use."""


class Search(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"lambda_": "lambda"}):
    """Where and for how long to look for drives."""

    target: float
    """Worst standard deviation of a pixel to reach [pixel]."""
    depth: tuple[float, float]
    """Nearest and farthest distance from the camera that the robot may have, along its view [m]."""
    side: float
    """Farthest to either side [m]."""
    lambda_: float
    """Metres that one square metre less of variance in the map is worth [1/m]."""
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


class _Defaults(msgspec.Struct, frozen=True):
    search: Search
    tries: Tries
    camera: Camera
    target: Target
    corner: float


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
    """The start, then every look on the way."""
    met: bool
    """Whether the worst pixel is as good as asked."""
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
    def poses(self) -> Array:
        """The poses (n, 3) at which the camera looks."""
        return np.array([stop.pose for stop in self.stops])


class Judged(msgspec.Struct, frozen=True):
    """A drive that people use, and what it gives from nominal intrinsics on."""

    motion: str
    stops: tuple[tuple[float, float, float], ...]
    length: float
    effort: float
    variance: float
    views: int
    """Panels seen in all."""
    worst: float
    """Worst standard deviation of a pixel [pixel]."""
    sigmas: tuple[float, ...] | None
    """Of the parameters from the views alone; None when they leave a direction open."""
    degenerate: bool
    """Whether a calibration from these views would be refused."""


class Tried(msgspec.Struct, frozen=True):
    """What calibrations from drawn corners of a drive gave."""

    mean: tuple[float, ...]
    """Of every parameter; empty when less than two were calibrated."""
    deviation: tuple[float, ...]
    predicted: tuple[float, ...] | None
    """Standard deviations that the views promise; None when they leave a direction open."""
    worst: float
    """Worst standard deviation of a pixel that they promise, from nominal intrinsics on [pixel]."""
    views: int
    refused: int
    reason: str | None
    """Why the last was refused."""


def mount(height: float, down: float) -> tuple[float, ...]:
    """Return ``T_floor_camera`` of a camera at a height [m], pitched down [rad], level across.

    Raises
    ------
    UserError
        When it does not look forward.
    """
    return _asked(lambda: tuple(_core.camera_mount(height, down)))


def plan_camera(
    stage: Stage,
    start: tuple[float, float, float],
    search: Search = DEFAULTS.search,
    *,
    covariance: Array | None = None,
    seen: Sequence[Detection] = (),
) -> CameraPlan:
    """Find the drives that make projections as certain as asked, each the best for what it costs.

    Parameters
    ----------
    stage
        What is there.
    start
        Where the robot stands: x, y [m], heading [rad].
    search
        The goal, the floor, what odometry loses.
    covariance
        (n, n) of the camera's parameters, when it was calibrated before; without it they are taken as nominal.
    seen
        What this camera saw of the panels since.

    Raises
    ------
    UserError
        When a number is out of range, or the robot starts where it may not be.
    """
    rows = None if covariance is None else np.asarray(covariance).tolist()
    known = _json({"covariance": rows, "views": [len(d.corners) for d in seen]})
    points, pixels, sigmas = flat_corners(stage.target, seen)
    found = _asked(lambda: _core.camera_plan(_json(stage), start, _json(search), known, points, pixels, sigmas))
    return msgspec.json.decode(found, type=CameraPlan)


def ranked(stage: Stage, distance: float, noise: Noise = DEFAULTS.search.noise) -> tuple[Judged, ...]:
    """Judge the drives that people use, their middle at a distance before the camera [m]: the best pixel first.

    Raises
    ------
    UserError
        When a number is out of range.
    """
    found = _asked(lambda: _core.camera_ranking(_json(stage), distance, _json(noise)))
    return msgspec.json.decode(found, type=tuple[Judged, ...])


def try_motion(stage: Stage, motion: str, distance: float, tries: Tries = DEFAULTS.tries) -> Tried:
    """Calibrate from drawn corners of a drive that people use, as often as asked.

    Raises
    ------
    UserError
        When there is no such drive, or a number is out of range.
    """
    if motion not in MOTIONS:
        raise UserError(f"no drive is called {motion!r}: there are {', '.join(MOTIONS)}")
    return msgspec.json.decode(
        _asked(lambda: _core.camera_trials(_json(stage), motion, distance, _json(tries))), type=Tried
    )


def middle_of_view(stage: Stage, search: Search = DEFAULTS.search) -> float:
    """Return how far before the camera its axis passes the middle of the panels, within the floor of the search [m]."""
    x, y, z, w = stage.mount[3:]
    ahead, up = 2 * (x * z + w * y), 1 - 2 * (x * x + y * y)
    heights = [panel.position[2] + _middle_height(panel.corners, panel.quaternion) for panel in stage.target.panels]
    drop = stage.mount[2] - sum(heights) / len(heights)
    near, far = search.depth
    distance = drop * ahead / -up if up < 0 < ahead else far
    return min(max(distance, near), far)


def _middle_height(corners: Array, quaternion: tuple[float, ...]) -> float:
    x, y, z, w = quaternion
    row = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    return float(row @ corners.mean(axis=0))


def _json(value: object) -> str:
    for number in _numbers(msgspec.to_builtins(value)):
        if not math.isfinite(number):
            raise UserError(f"{number} is no number to plan with: it must be finite")
    return msgspec.json.encode(value).decode()


def _numbers(value: object) -> list[float]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return [number for part in value for number in _numbers(part)]
    return [value] if isinstance(value, float) else []


def _asked(ask: Callable[[], T]) -> T:
    try:
        return ask()
    except (ValueError, OverflowError) as error:
        raise UserError(str(error)) from error

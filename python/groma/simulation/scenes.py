"""Simulated recordings with their truth.

A scenario (a building drawn from a seed, a vehicle, its scanner and what is wrong with them) becomes the messages that
a recorder would have written, and the poses that no recorder knows. All values of a scenario, their defaults included,
are those of the Rust core; ``scenario("loop", seed=3)`` returns them, ``msgspec.structs.replace`` changes them.
The same scenario gives the same bytes.

Relations for the metric of ``groma.evaluation.relations``: the true pose of one scan seen from another, for scans about
five seconds apart, and for places that are seen again: more than a minute later, within two metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from groma import _core
from groma.errors import UserError
from groma.evaluation.relations import Relations
from groma.io.atomic import write_text
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message, Odometry, Transform
from groma.nouns.poses import quaternion_of, relative

STEP = 5.0
"""Time between the scans of a relation, and between the scans that are asked whether they see a place again [s]."""
AGAIN_AFTER = 60.0
"""Time after which a place counts as seen again [s]."""
AGAIN_WITHIN = 2.0
"""Distance within which it is the same place [m]."""


class Differential(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="differential"):
    """Two driven wheels on one axle [m]."""

    left_radius: float
    right_radius: float
    separation: float


class Tricycle(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="tricycle"):
    """One steered, driven wheel in front of a fixed axle [m, rad]."""

    radius: float
    wheelbase: float
    steering_offset: float


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How fast the vehicle moves, and how it steers."""

    step: float
    """Time of one step of the drive [s]."""
    speed: float
    acceleration: float
    turn_rate: float
    turn_acceleration: float
    corner_radius: float
    ahead: float
    """Distance of the point that is steered to [m]."""
    sway: float
    """How far the vehicle sways to either side of its path [m]."""


class Scanner(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The laser scanner and what is wrong with its readings."""

    mount: tuple[float, float, float]
    """``T_base_laser`` as x, y [m] and yaw [rad]."""
    beams: int
    angle_min: float
    angle_increment: float
    period: float
    """Time between sweeps [s]."""
    time_increment: float
    """Time between beams [s]; 0 for a snapshot."""
    range_min: float
    range_max: float
    sigma: float
    """Standard deviation of a range [m]."""
    quantum: float
    """Step of the range output [m]; 0 for none."""
    dropout: float
    """Share of echoes that are lost."""


class WheelErrors(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is wrong with the wheels and with what the odometry believes of them."""

    radius: tuple[float, float]
    """Relative errors of the radii: left and right, or the driven wheel."""
    base: float
    """Relative error of the wheel separation or the wheelbase."""
    steering: float
    """Error of the steering offset [rad]."""
    slip: float
    """Standard deviation of a wheel's travel after one metre [m]."""
    encoder_step: float
    """Step of the encoders [rad]; 0 for none."""
    final_error: float | None
    """If given, all errors are scaled such that the odometry ends so far from the truth [m]."""


class Depot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The warehouse hung with reflectors, on a day of its life."""

    plan: int
    """Draws the building; the seed of the scenario draws the noise alone."""
    day: int
    """Draws the stock."""
    changed: float
    """Share of the places for pallets that are drawn anew on this day."""
    reflectors: float
    """Share of the reflectors that hang."""
    drive: str
    """``survey``, ``back``, ``path1`` to ``path4`` or ``halts``."""


class InDepot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A building that is reported in more than a word."""

    depot: Depot


class Scenario(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that a simulation depends on."""

    building: str | InDepot
    """``rooms``, ``warehouse``, ``loop`` or the depot."""
    seed: int
    start: float
    """Stamp of the start [s]."""
    vehicle: Differential | Tricycle
    clearance: float
    """Radius of the circle around the base that must stay free [m]."""
    limits: Limits
    scanner: Scanner
    wheels: WheelErrors
    odometry_every: int
    """Odometry and joints are reported every so many steps of the drive."""
    stalls: int
    """How often the odometry stands still while the vehicle moves."""
    stall_duration: float


@dataclass(frozen=True, slots=True)
class Simulated:
    """A recording and its truth; poses are ``T_world_base`` as x [m], y [m], theta [rad]."""

    scenario: Scenario
    stamps: Array
    """(K,) stamps of the odometry [s]."""
    truth: Array
    """(K, 3) true poses at these stamps."""
    odometry: Array
    """(K, 3) ``T_odom_base``, the identity at the start."""
    joint_names: tuple[str, str]
    joints: Array
    """(K, 2) wheel angles, or angle of the driven wheel and steering angle of the last step of the drive [rad]."""
    scan_stamps: Array
    """(S,) [s]."""
    scan_truth: Array
    """(S, 3) true poses at these stamps."""
    ranges: Array
    """(S, B) [m]; ``+inf`` no return, NaN too close."""
    intensities: Array
    """(S, B)."""
    stalls: Array
    """(N, 2) start and duration of the stalls of the odometry [s]."""
    segments: Array
    """(W, 5) walls: x, y, x, y [m], reflectivity."""
    circles: Array
    """(C, 4) pillars, legs and the like: x, y, radius [m], reflectivity."""

    def __iter__(self) -> Iterator[Message]:
        """Yield all messages as a recorder takes them: a scan after its last beam, so after the odometry until then."""
        yield self._mount()
        scans = map(self._scan, range(len(self.scan_stamps)))
        scan = next(scans, None)
        for k, stamp in enumerate(self.stamps):
            while scan is not None and scan.end < stamp:
                yield scan
                scan = next(scans, None)
            yield self._odometry(k)
            yield self._joints(k)
        if scan is not None:
            yield from (scan, *scans)

    def _mount(self) -> Transform:
        x, y, yaw = self.scenario.scanner.mount
        turn = quaternion_of(yaw)
        return Transform(self.scenario.start, "tf_static", "base_link", "laser", (x, y, 0.0), turn, static=True)

    def _odometry(self, k: int) -> Odometry:
        x, y, theta = self.odometry[k].tolist()
        return Odometry(float(self.stamps[k]), "odom", x, y, theta)

    def _joints(self, k: int) -> JointState:
        before = max(k - 1, 0)
        time = self.stamps[k] - self.stamps[before]
        velocities = (self.joints[k] - self.joints[before]) / time if k else np.zeros(2)
        return JointState(float(self.stamps[k]), "joint_states", self.joint_names, self.joints[k], velocities)

    def _scan(self, k: int) -> LaserScan:
        stamp = float(self.scan_stamps[k])
        return LaserScan(stamp, "scan", "laser", beam_geometry(self.scenario), self.ranges[k], self.intensities[k])


def scenes() -> list[str]:
    """Return the names of the scenarios."""
    return _core.simulation_scenes()


def scenario(scene: str, seed: int = 1) -> Scenario:
    """Return the scenario called ``scene``.

    Raises
    ------
    UserError
        When there is none of that name.
    """
    try:
        return msgspec.json.decode(_core.simulation_scenario(scene, seed), type=Scenario)
    except ValueError as error:
        raise UserError(str(error)) from error


def simulate(scenario: Scenario, token: _core.Token | None = None) -> Simulated:
    """Drive a scenario, until the token is cancelled.

    Raises
    ------
    UserError
        When a setting makes no sense, or the vehicle cannot follow its route or touches something.
    """
    try:
        core = _core.simulate_scenario(msgspec.json.encode(scenario).decode(), token)
    except ValueError as error:
        raise UserError(f"scenario: {error}") from error
    return Simulated(
        scenario=scenario,
        stamps=core.odometry_stamps,
        truth=core.truth,
        odometry=core.odometry,
        joint_names=core.joint_names,
        joints=core.joints,
        scan_stamps=core.scan_stamps,
        scan_truth=core.scan_poses,
        ranges=core.ranges,
        intensities=core.intensities,
        stalls=core.stalls,
        segments=core.segments,
        circles=core.circles,
    )


def beam_geometry(scenario: Scenario) -> BeamGeometry:
    """Return the beam geometry of the scans of a scenario."""
    laser = scenario.scanner
    return BeamGeometry(laser.angle_min, laser.angle_increment, laser.time_increment, laser.range_min, laser.range_max)


def true_relations(stamps: Array, poses: Array) -> Relations:
    """Return the relations of a true trajectory.

    Parameters
    ----------
    stamps
        (S,) strictly rising [s].
    poses
        (S, 3) true poses.
    """
    asked = np.unique(np.searchsorted(stamps, np.arange(stamps[0], stamps[-1], STEP)))
    pairs = list(zip(asked[:-1].tolist(), asked[1:].tolist(), strict=True))
    pairs += [(i, int(j)) for j in asked if (i := _seen_before(stamps, poses, int(j))) is not None]
    index = np.array(sorted(pairs), dtype=np.int64).reshape(-1, 2)
    first, second = index.T
    return Relations(stamps[index], relative(poses[first], poses[second]), planar=True)


def _seen_before(stamps: Array, poses: Array, j: int) -> int | None:
    """Return the scan nearest in space to scan ``j`` among those far enough before it in time."""
    before = int(np.searchsorted(stamps, stamps[j] - AGAIN_AFTER))
    if before == 0:
        return None
    distances = np.hypot(*(poses[:before, :2] - poses[j, :2]).T)
    i = int(np.argmin(distances))
    return i if distances[i] <= AGAIN_WITHIN else None


def write_relations(path: Path, relations: Relations) -> None:
    """Write ``t_i t_j x y z roll pitch yaw`` a line, 9 decimals."""
    rows = np.column_stack([relations.times, relations.poses[:, :2], np.zeros((len(relations.times), 3))])
    table = np.column_stack([rows, relations.poses[:, 2]])
    write_text(path, "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in table.tolist()))

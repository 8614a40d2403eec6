"""Drives by which localization is judged: a warehouse that is mapped on one day and driven through on others.

The paths have the lengths of F. Kallasi, thesis, Parma 2017, table 5.6 (12, 12, 12, 7 m). The vehicle is a tricycle
that was calibrated: its parameters are the true ones with errors of the size that a calibration leaves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import msgspec
import numpy as np

from groma.nouns.arrays import Array
from groma.nouns.vehicle import Vehicle
from groma.simulation.scenes import Depot, InDepot, Scenario, Tricycle, scenario

DriveName = Literal["survey", "back", "path1", "path2", "path3", "path4", "halts"]
PATHS: tuple[DriveName, ...] = ("path1", "path2", "path3", "path4")

SIGMAS = {
    "drive_scale": 6e-6,
    "steering_offset": 1.7e-4,
    "wheelbase": 0.002,
    "laser_x": 0.001,
    "laser_y": 0.001,
    "laser_yaw": 4e-4,
}
"""What a calibration leaves open [m, rad]: half the bars of groma's own."""


@dataclass(frozen=True, slots=True)
class Day:
    """The warehouse as it is on a day."""

    plan: int = 1
    """Draws the building."""
    day: int = 0
    """Draws what was moved."""
    changed: float = 0.0
    """Share of the places for pallets that are drawn anew."""
    reflectors: float = 1.0
    """Share of the reflectors that hang."""


@dataclass(frozen=True, slots=True)
class Rounds:
    """A survey of the warehouse on one day, and drives in it on another."""

    runs: int = 6
    """Drives along each path."""
    reflectors: float = 1.0
    """Share of the reflectors that hang, during the survey and after."""
    changed: float = 0.1
    """Share of the pallets that were moved since the survey."""
    seed: int = 1
    """Draws the building, what was moved, and what the calibration is off by."""

    def day(self, drive: DriveName) -> Day:
        """Return the warehouse as it is on a drive."""
        if drive == "survey":
            return Day(self.seed, 0, 0.0, self.reflectors)
        return Day(self.seed, 1, self.changed, self.reflectors)


def drive_scenario(drive: DriveName, day: Day, seed: int) -> Scenario:
    """Return the scenario of a drive; the seed draws its noise.

    Raises
    ------
    UserError
        When the seed cannot be one.
    """
    plain = scenario("depot", seed)
    depot = Depot(plan=day.plan, day=day.day, changed=day.changed, reflectors=day.reflectors, drive=drive)
    return msgspec.structs.replace(plain, building=InDepot(depot))


def drives(runs: int) -> Iterator[tuple[str, DriveName, int]]:
    """Yield name, drive and seed of every recording: the survey, the paths again and again, the halting points."""
    yield "survey", "survey", 1
    for k, path in enumerate(PATHS):
        for run in range(1, runs + 1):
            yield f"{path}-run{run}", path, 100 * (k + 1) + run
    yield "halts", "halts", 2


def calibrated_vehicle(plain: Scenario, seed: int) -> Vehicle:
    """Return the vehicle of a scenario as a calibration would find it.

    The steering encoder cuts down: what it says is half a step too small in the mean, and a calibration takes that for
    a part of the offset.
    """
    true = plain.vehicle
    if not isinstance(true, Tricycle):
        raise TypeError(f"a {type(true).__name__} has no steering")
    x, y, yaw = plain.scanner.mount
    values = {
        "drive_scale": true.radius,
        "steering_offset": true.steering_offset + plain.wheels.encoder_step / 2,
        "wheelbase": true.wheelbase,
        "steering_gain": 1.0,
        "laser_x": x,
        "laser_y": y,
        "laser_yaw": yaw,
        "delay": 0.0,
    }
    noise = np.random.default_rng(seed).standard_normal(len(SIGMAS))
    for (name, sigma), draw in zip(SIGMAS.items(), noise.tolist(), strict=True):
        values[name] += sigma * draw
    covariance = np.diag(np.square(list(SIGMAS.values())))
    return Vehicle("tricycle", values, tuple(SIGMAS), covariance, "rad", ("traction_joint", "steering_joint"))


def standing_reflectors(circles: Array, segments: Array) -> Array:
    """Return the centres (R, 2) of the reflectors of a simulated world, as a surveyor would."""
    posts = circles[circles[:, 3] > 1, :2]
    plates = segments[segments[:, 4] > 1]
    return np.vstack([posts, (plates[:, :2] + plates[:, 2:4]) / 2])

"""The relations metric: how well an estimate keeps hand-checked relative poses.

A relations file has one true relative pose a line, ``t_i t_j x y z roll pitch yaw`` (m, rad): the robot at t_j, seen
from groma.nouns.arrays import Array
from the robot at t_i. With the estimate x,

    d_ij    = x_i^-1 x_j,    e_ij = d*_ij^-1 d_ij
    e_trans = || trans(e_ij) || [m],    e_rot = | angle(e_ij) | [deg]

reported as mean and standard deviation (n - 1), of the errors and of their squares. Nothing is aligned.

Source: Kuemmerle et al., "On measuring the accuracy of SLAM algorithms", Autonomous Robots 27, 2009,
doi 10.1007/s10514-009-9155-6. Relations of which a time has no pose are left out; their number is part of the result.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groma.errors import UserError
from groma.evaluation.association import Matching, look_up
from groma.io.table import read_table
from groma.io.trajectory import Trajectory
from groma.nouns.arrays import Array
from groma.nouns.poses import relative

_FLAT = 1e-6


@dataclass(frozen=True, slots=True)
class Relations:
    """True relative poses."""

    times: Array
    """(N, 2) from, to [s]."""
    poses: Array
    """(N, 3) x, y, yaw."""
    planar: bool
    """Whether z, roll and pitch, which are not compared, are zero."""


@dataclass(frozen=True, slots=True)
class RelationErrors:
    """What the estimate makes of the relations."""

    total: int
    """Relations in the file."""
    translation: Array
    """(M,) metres, of the relations evaluated."""
    rotation: Array
    """(M,) degrees, 0..180."""
    how: dict[str, int]
    """How the different times got their poses: `near`, `odometry`, `interp`, `missing`."""
    worst_gap: float
    """Largest time between a relation and the pose used [s]."""


def read_relations(path: Path) -> Relations:
    """Read a relations file, plain or gzipped.

    Raises
    ------
    UserError
        When the file cannot be read (naming the line), is empty, or has a value that is not finite.
    """
    table = read_table(path, 8)
    if not len(table):
        raise UserError(f"{path}: no relation in it; expected lines of: t_i t_j x y z roll pitch yaw")
    if not np.isfinite(table).all():
        raise UserError(f"{path}: a relation with NaN or infinity")
    return Relations(table[:, :2], table[:, [2, 3, 7]], bool((np.abs(table[:, 4:7]) <= _FLAT).all()))


def evaluate_relations(
    relations: Relations,
    estimate: Trajectory,
    odometry: Trajectory | None = None,
    matching: Matching = Matching(),  # noqa: B008
) -> RelationErrors:
    """Compare an estimate with relations; see `association` for how a time gets its pose."""
    times, inverse = np.unique(relations.times, return_inverse=True)
    found = look_up(estimate, times, matching, odometry)
    poses = found.poses[inverse.reshape(-1, 2)]
    usable = np.isfinite(poses).all(axis=(1, 2))
    error = relative(relations.poses, relative(poses[:, 0], poses[:, 1]))[usable]
    return RelationErrors(
        len(relations.times),
        np.hypot(error[:, 0], error[:, 1]),
        np.degrees(np.abs(error[:, 2])),
        dict(sorted(Counter(found.how.tolist()).items())),
        float(found.gaps[found.found].max(initial=0.0)),
    )

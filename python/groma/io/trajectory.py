"""Trajectories in the plane as text: TUM (with stamps) and KITTI (without).

TUM      one pose a line, ``stamp x y z qx qy qz qw``; seconds, metres, unit quaternion; ``#`` comments. In the plane
         z = 0 and q = (0, 0, sin(theta/2), cos(theta/2)). Written with 9 decimals, single and no trailing blanks.
KITTI    one pose a line, the first three rows of the 4x4 matrix T_map_base, row by row; stamps in a file of their own,
         one per line. The original data set gives poses of its left camera; ours are those of base_link, and the format
         has no place to say so.

Source: vision.in.tum.de/data/datasets/rgbd-dataset/file_formats, cvlibs.net/datasets/kitti/eval_odometry.php.
Height, roll and pitch are dropped on reading: yaw is the rotation about z of the Z-Y-X Euler angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.table import read_table
from groma.nouns.arrays import Array
from groma.nouns.bounds import are_within
from groma.nouns.poses import matrices_of, poses_of, quaternions_of, yaws_of


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Poses in the order of time."""

    stamps: Array
    """(N,) seconds, strictly increasing."""
    poses: Array
    """(N, 3) x [m], y [m], theta [rad]."""
    skipped: int = 0
    """Rows of the file that were left out: not finite, out of bounds, or without a rotation."""
    repeated: int = 0
    """Rows of the file that were left out because an earlier row has the same stamp."""


def read_tum(path: Path) -> Trajectory:
    """Read a TUM trajectory, plain or gzipped, in any order of time; of equal stamps the first row counts.

    Raises
    ------
    UserError
        When the file cannot be read (naming the line) or holds no pose.
    """
    table = read_table(path, 8)
    usable = _are_poses(table[:, 0], table[:, 1:4], table[:, 4:]) & (table[:, 4:] != 0).any(axis=1)
    rows = table[usable]
    stamps, first = np.unique(rows[:, 0], return_index=True)
    if not len(stamps):
        raise UserError(f"{path}: no pose in it; expected lines of: stamp x y z qx qy qz qw")
    kept = rows[first]
    poses = np.column_stack([kept[:, 1:3], yaws_of(kept[:, 4:])])
    return Trajectory(stamps, poses, len(table) - len(rows), len(rows) - len(stamps))


def write_tum(path: Path, stamps: Array, poses: Array) -> None:
    """Write poses (N, 3) at stamps (N,) as TUM.

    Raises
    ------
    ValueError
        When a value is not finite: nobody could read the file.
    """
    level = np.zeros(len(poses))
    write_tum_rows(path, np.column_stack([stamps, poses[:, :2], level, quaternions_of(poses[:, 2])]))


def write_tum_rows(path: Path, rows: Array) -> None:
    """Write poses in space as TUM: (N, 8) stamp, x, y, z, and the quaternion x, y, z, w.

    Raises
    ------
    ValueError
        When a value is not finite: nobody could read the file.
    """
    write_text(path, _rows(rows))


def read_kitti(path: Path, times: Path) -> Trajectory:
    """Read KITTI poses and their stamps, plain or gzipped.

    Raises
    ------
    UserError
        When a file cannot be read, is empty, or the two do not fit each other.
    """
    matrices, stamps = read_table(path, 12), read_table(times, 1)[:, 0]
    if not len(matrices):
        raise UserError(f"{path}: no pose in it; expected lines of 12 numbers")
    if len(stamps) != len(matrices):
        raise UserError(f"{times}: {len(stamps)} stamps for the {len(matrices)} poses of {path}")
    if not (_are_poses(stamps, matrices, matrices).all() and (np.diff(stamps) > 0).all()):
        raise UserError(f"{path}, {times}: poses and stamps must be finite and within 1e7 m, stamps must grow")
    return Trajectory(stamps, poses_of(matrices))


def write_kitti(path: Path, times: Path, stamps: Array, poses: Array) -> None:
    """Write poses (N, 3) as KITTI and their stamps (N,) beside them."""
    write_text(path, _rows(matrices_of(poses)))
    write_text(times, _rows(stamps[:, None]))


def _are_poses(stamps: Array, positions: Array, rotations: Array) -> NDArray[np.bool_]:
    """Return which rows hold numbers that a pose can have."""
    places = are_within("coordinate", positions) & are_within("coordinate", rotations)
    return places & are_within("stamp", stamps[:, None])


def _rows(table: Array) -> str:
    if not np.isfinite(table).all():
        raise ValueError("a trajectory with NaN or infinity cannot be written")
    line = " ".join(["%.9f"] * table.shape[1]) + "\n"
    rounded = np.round(table, 9) + 0.0  # + 0.0 turns -0 into 0, so that equal poses are equal text
    return "".join(line % tuple(row) for row in rounded.tolist())

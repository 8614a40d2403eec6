"""Errors against a reference trajectory: absolute (ATE) and relative (RPE), in the plane.

ATE   With T = argmin sum || T p_i - p*_i ||^2 over the rigid motions of the plane (no scale), the errors are
      || T p_i - p*_i ||. Centred positions q, q*: theta = atan2(sum q x q*, sum q . q*), t = mean p* - R mean p.
RPE   With e = (x*_i^-1 x*_j)^-1 (x_i^-1 x_j), the errors are || trans(e) || and | angle(e) |, over j = i + 1 (a frame),
      and over the first j that lies a given length of the reference's path behind i.

Source: Umeyama, PAMI 13(4), 1991; Sturm et al., IROS 2012 (TUM RGB-D benchmark); Geiger et al., CVPR 2012 (KITTI,
lengths).
An estimated pose is compared with the reference's pose at its time, by the rule of `association`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.evaluation.association import Matching, look_up
from groma.io.trajectory import Trajectory
from groma.nouns.arrays import Array
from groma.nouns.poses import align, compose, relative

Indices = NDArray[np.int64]

LENGTHS = (1.0, 10.0, 100.0)


@dataclass(frozen=True, slots=True)
class RelativeErrors:
    """RPE over one kind of pair."""

    translation: Array
    """(M,) metres."""
    rotation: Array
    """(M,) degrees."""


@dataclass(frozen=True, slots=True)
class ReferenceErrors:
    """What separates an estimate from a reference."""

    total: int
    """Poses of the estimate."""
    worst_gap: float
    """Largest time between an estimated pose and the reference pose used [s]."""
    alignment: Array
    """(3,) T_reference_estimate."""
    ate: Array
    """(M,) metres."""
    frames: RelativeErrors
    lengths: dict[float, RelativeErrors]
    """By length of path [m]; only those that fit into the reference."""


def evaluate_reference(
    estimate: Trajectory,
    reference: Trajectory,
    matching: Matching = Matching(),  # noqa: B008
) -> ReferenceErrors:
    """Compare an estimate with a reference.

    Raises
    ------
    UserError
        When fewer than two poses have a counterpart.
    """
    found = look_up(reference, estimate.stamps, matching)
    if np.count_nonzero(found.found) < 2:
        raise UserError(f"only {np.count_nonzero(found.found)} poses have a reference within {matching.max_dt} s")
    x, true = estimate.poses[found.found], found.poses[found.found]
    alignment = align(x[:, :2], true[:, :2])
    offset = compose(alignment, x)[:, :2] - true[:, :2]
    path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(true[:, :2], axis=0).T))])
    every = np.arange(len(x))
    pairs = {length: _pairs_behind(path, length) for length in LENGTHS}
    return ReferenceErrors(
        len(estimate.stamps),
        float(found.gaps[found.found].max()),
        alignment,
        np.hypot(*offset.T),
        _relative_errors(x, true, every[:-1], every[1:]),
        {length: _relative_errors(x, true, *pair) for length, pair in pairs.items() if len(pair[0])},
    )


def _pairs_behind(path: Array, length: float) -> tuple[Indices, Indices]:
    """Return the indices of all poses that have one at least a length of path behind, and of the first such one."""
    j = np.searchsorted(path, path + length)
    i = np.flatnonzero(j < len(path))
    return i, j[i]


def _relative_errors(x: Array, true: Array, i: Indices, j: Indices) -> RelativeErrors:
    error = relative(relative(true[i], true[j]), relative(x[i], x[j]))
    return RelativeErrors(np.hypot(error[:, 0], error[:, 1]), np.degrees(np.abs(error[:, 2])))

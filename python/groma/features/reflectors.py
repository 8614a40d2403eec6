"""Marks of reflecting tape in laser scans, by how bright they are and how wide; they have no identities.

Formulas and limits: ``crates/features/src/reflector``. Points are in the laser frame, metres and radians.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry


class ReflectorOptions(TypedDict, total=False):
    """Settings of the detector."""

    contrast: float
    """A reflector is at least so many times brighter than diffuse surfaces at its range; 2."""
    spread_factor: float
    """And by so many times the upward spread of their logarithms; 4."""
    peer_share: float
    """The logarithm of its contrast is at least this share of that of the brightest mark of the scan; 0.5."""
    width_min: float
    """Narrowest mark [m]; 0.03."""
    width_max: float
    """Widest mark [m]; 1."""
    post_radius: float
    """Radius of the posts that carry tape [m]; 0 where all marks are flat; 0.04."""
    range_min: float
    """Nearer beams are no reflectors [m]; 0.3."""
    range_max: float
    """Farther beams are no reflectors [m]; 30."""
    range_noise: float
    """Least standard deviation of a range [m]; 0.01."""


@dataclass(frozen=True, slots=True)
class Reflectors:
    """The K reflectors of one scan, in beam order, in the laser frame."""

    index: NDArray[np.int64]
    """(K,) beam in the middle."""
    point: Array
    """(K, 2) centre: the middle of a flat mark, the axis of a post [m]."""
    covariance: Array
    """(K, 2, 2) of the centre [m^2]."""
    post: Array
    """(K,) probability that it is a post."""
    width: Array
    """(K,) across the line of sight [m]."""
    contrast: Array
    """(K,) by how many times it is brighter than a diffuse surface at its range."""

    def __len__(self) -> int:
        return len(self.index)


def reflectors(
    ranges: ArrayLike, intensities: ArrayLike, geometry: BeamGeometry, **options: Unpack[ReflectorOptions]
) -> Reflectors:
    """Find the reflectors of a scan.

    Parameters
    ----------
    ranges
        (N,) readings [m]; what is no hit under the geometry (NaN, infinite, zero, beyond the maximum) is no point.
    intensities
        (N,) in any unit that grows with the light, scaled with range or not; a scan without them, (0,), has no
        reflectors.
    geometry
        Where the beams point; a scan that goes all round has no seam.
    **options
        See :class:`ReflectorOptions`.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or the arrays are not one-dimensional and of one length.
    """
    return reflectors_batch([ranges], [intensities], geometry, **options)[0]


def reflectors_batch(
    scans: ArrayLike | Sequence[ArrayLike],
    intensities: ArrayLike | Sequence[ArrayLike],
    geometry: BeamGeometry,
    **options: Unpack[ReflectorOptions],
) -> list[Reflectors]:
    """Find the reflectors of many scans of one scanner, over all processors, without holding the interpreter.

    Parameters
    ----------
    scans, intensities
        (S, N) each, or S arrays each.
    geometry
        Where the beams point.
    **options
        See :class:`ReflectorOptions`.

    Returns
    -------
    list
        One :class:`Reflectors` a scan, in order, the same with any number of threads.

    Raises
    ------
    ValueError
        As :func:`reflectors`.
    """
    pairs = [_pair(r, i) for r, i in zip(scans, intensities, strict=True)]  # type: ignore[arg-type]
    if not pairs:
        return []
    beams = (geometry.angle_min, geometry.angle_increment, geometry.range_min, geometry.range_max)
    flat_ranges, flat_intensities = (np.concatenate(arrays) for arrays in zip(*pairs, strict=True))
    counts = [len(r) for r, _ in pairs]
    found, index, rows = _core.reflector_detect(flat_ranges, flat_intensities, counts, beams, json.dumps(options))
    cuts = np.cumsum(found)[:-1]
    table = rows.reshape(-1, 9)
    columns = (index, table[:, :2], table[:, 2:6].reshape(-1, 2, 2), table[:, 6], table[:, 7], table[:, 8])
    return [Reflectors(*parts) for parts in zip(*(np.split(c, cuts) for c in columns), strict=True)]


def _pair(ranges: ArrayLike, intensities: ArrayLike) -> tuple[Array, Array]:
    """Return both as vectors of one length; intensities that are not there are NaN."""
    r = np.ascontiguousarray(ranges, dtype=np.float64)
    i = np.ascontiguousarray(intensities, dtype=np.float64)
    if i.shape == (0,):
        i = np.full(r.shape, np.nan)
    if r.ndim != 1 or i.shape != r.shape:
        raise ValueError(f"ranges {r.shape} and intensities {i.shape}: they must be vectors of one length")
    return r, i

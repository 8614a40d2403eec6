"""Corners of laser scans: find them, describe them, tell places apart by them, pair them between two maps.

Source: Kallasi, Rizzini, Caselli, "Fast keypoint features from laser scanner for robot localization and mapping",
IEEE RA-L 1(1), 2016 (FALKO, OC, BSC, CGH); Kallasi, Rizzini, IROS 2016 (GLAROT). Formulas: docs/theory/features.md.
Keypoints and points are in the laser frame, metres and radians. Settings are given by name; their defaults are
:func:`defaults`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.feature_options import AssociationOptions, FalkoOptions, GlarotOptions, OcOptions
from groma.models import BeamGeometry

Array = NDArray[np.float64]
_Detect = Callable[
    [Array, list[int], tuple[float, float, float, float], str],
    tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, Array, Array],
]


def defaults() -> tuple[FalkoOptions, GlarotOptions, AssociationOptions]:
    """Return the default settings of :func:`falko`, :class:`Signature` and :func:`associate`."""
    falko, glarot, association = (json.loads(text) for text in _core.feature_defaults())
    return falko, glarot, association


@dataclass(frozen=True, slots=True)
class Keypoints:
    """The K keypoints of one scan, in beam order, in the laser frame."""

    index: NDArray[np.int64]
    """(K,) beam that hit the corner."""
    point: Array
    """(K, 2) position [m]."""
    orientation: Array
    """(K,) direction into which the corner opens, in (-pi, pi] [rad]."""
    radius: Array
    """(K,) radius of the neighbourhood in which the corner was judged [m]."""
    covariance: Array
    """(K, 2, 2) of the position [m^2]."""

    def __len__(self) -> int:
        return len(self.index)


def falko(ranges: ArrayLike, geometry: BeamGeometry, **options: Unpack[FalkoOptions]) -> Keypoints:
    """Find the corners of a scan.

    Parameters
    ----------
    ranges
        (N,) readings [m]; what is no hit under the geometry (NaN, infinite, zero, beyond the maximum) is no point.
    geometry
        Where the beams point; a scan that goes all round has no seam.
    **options
        See :class:`FalkoOptions`.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or ``ranges`` is not one-dimensional.
    """
    return falko_batch([ranges], geometry, **options)[0]


def falko_batch(
    scans: ArrayLike | Sequence[ArrayLike], geometry: BeamGeometry, **options: Unpack[FalkoOptions]
) -> list[Keypoints]:
    """Find the corners of many scans of one scanner, over all processors, without holding the interpreter.

    Parameters
    ----------
    scans
        (S, N) readings [m], or S arrays of readings.
    geometry
        Where the beams point.
    **options
        See :class:`FalkoOptions`.

    Returns
    -------
    list
        One :class:`Keypoints` a scan, in order, the same with any number of threads.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or a scan is not one-dimensional.
    """
    return _detect(_core.falko_detect, scans, geometry, json.dumps(options))


def oc(ranges: ArrayLike, geometry: BeamGeometry, **options: Unpack[OcOptions]) -> Keypoints:
    """Find the corners of walls at right angles, all in the one direction that dominates the scan.

    Parameters
    ----------
    ranges
        (N,) readings [m]; what is no hit under the geometry is no point.
    geometry
        Where the beams point; a scan that goes all round has no seam.
    **options
        See :class:`OcOptions`.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or ``ranges`` is not one-dimensional.
    """
    return oc_batch([ranges], geometry, **options)[0]


def oc_batch(
    scans: ArrayLike | Sequence[ArrayLike], geometry: BeamGeometry, **options: Unpack[OcOptions]
) -> list[Keypoints]:
    """Find the orthogonal corners of many scans, as :func:`falko_batch` does those of any angle."""
    return _detect(_core.oc_detect, scans, geometry, json.dumps(options))


def _detect(
    detect: _Detect, scans: ArrayLike | Sequence[ArrayLike], geometry: BeamGeometry, options: str
) -> list[Keypoints]:
    arrays = [_vector("a scan", scan) for scan in scans]  # type: ignore[union-attr]
    flat = np.concatenate(arrays) if arrays else np.empty(0)
    counts = [len(array) for array in arrays]
    found, index, point, *rest = detect(flat, counts, _beams(geometry), options)
    orientation, radius, covariance = rest
    cuts = np.cumsum(found)[:-1]
    columns = (index, point.reshape(-1, 2), orientation, radius, covariance.reshape(-1, 2, 2))
    return [Keypoints(*parts) for parts in zip(*(np.split(c, cuts) for c in columns), strict=True)] if arrays else []


def bsc(
    ranges: ArrayLike, geometry: BeamGeometry, keypoints: Keypoints, radius: float | None = None
) -> NDArray[np.uint8]:
    """Describe keypoints by which cells of a polar grid around them hold points (binary shape context).

    Parameters
    ----------
    ranges, geometry
        (N,) The scan in which the keypoints were found.
    keypoints
        K keypoints.
    radius
        Radius of the grid [m]; that of each keypoint when left out.

    Returns
    -------
    numpy.ndarray
        (K, 16) bytes: 8 rings of 16 sectors, the bit of sector 0 (along the orientation) lowest.
    """
    scan = _vector("ranges", ranges)
    cells = _core.bsc_describe(scan, _beams(geometry), keypoints.index, _poses(keypoints, radius))
    return cells.reshape(-1, 16)


def cgh(
    ranges: ArrayLike, geometry: BeamGeometry, keypoints: Keypoints, radius: float | None = None
) -> NDArray[np.float32]:
    """Describe keypoints by the directions of the points around them (cumulative Gaussian histogram).

    Parameters
    ----------
    ranges, geometry
        (N,) The scan in which the keypoints were found.
    keypoints
        K keypoints.
    radius
        Radius of the neighbourhood [m]; that of each keypoint when left out.

    Returns
    -------
    numpy.ndarray
        (K, 16) shares of 16 sectors, counted from the orientation; rows sum to one, or to zero without points.
    """
    scan = _vector("ranges", ranges)
    shares = _core.cgh_describe(scan, _beams(geometry), keypoints.index, _poses(keypoints, radius))
    return shares.reshape(-1, 16)


def bsc_distance(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Cells that differ, of every descriptor of a (N, 16) with every of b (M, 16): (N, M), 0 to 128."""
    different: NDArray[np.int64] = np.bitwise_count(a[:, None] ^ b[None]).sum(axis=2, dtype=np.int64)
    return different


def cgh_distance(a: NDArray[np.float32], b: NDArray[np.float32]) -> Array:
    """Symmetric chi-square distance of every descriptor of a (N, 16) with every of b (M, 16): (N, M), 0 to 1."""
    h, g = a[:, None].astype(np.float64), b[None].astype(np.float64)
    total = h + g
    distance: Array = 0.5 * np.divide((h - g) ** 2, total, out=np.zeros_like(total), where=total > 0).sum(axis=2)
    empty = ~np.logical_and.outer(np.any(a, axis=1), np.any(b, axis=1))
    return np.where(empty, 1.0, distance)


class Signature:
    """GLAROT: the histogram of the directions and lengths of all pairs of a set of landmarks.

    It does not change when the set is moved, but for a shift of the directions when it is turned.

    Parameters
    ----------
    points
        (N, 2) landmarks [m], in any order and frame.
    **options
        See :class:`GlarotOptions`.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, or ``points`` is not (N, 2) and finite.
    """

    def __init__(self, points: ArrayLike, **options: Unpack[GlarotOptions]) -> None:
        self._core = _core.GlarotSignature(_points("points", points), json.dumps(options))

    def distance(self, other: Signature) -> tuple[float, float]:
        """Distance, 0 to 1, and the rotation that takes the points of self onto those of other, modulo pi [rad]."""
        return self._core.distance(other._core)


class SignatureIndex:
    """Signatures, of which the nearest to a given one are found exactly."""

    def __init__(self) -> None:
        self._core = _core.GlarotIndex()

    def __len__(self) -> int:
        return len(self._core)

    def add(self, signature: Signature) -> int:
        """Add a signature; the place it gets."""
        return self._core.add(signature._core)

    def query(self, signature: Signature, k: int, allowed: ArrayLike | None = None) -> list[tuple[int, float, float]]:
        """Find the k nearest.

        Parameters
        ----------
        signature
            What to look for.
        k
            How many at most.
        allowed
            (len,) mask of the places that may be returned; all when left out.

        Returns
        -------
        list
            ``(place, distance, rotation)``, nearest first, as :meth:`Signature.distance` gives them.
        """
        mask = None if allowed is None else np.ascontiguousarray(allowed, dtype=np.bool_)
        return self._core.query(signature._core, k, mask)


@dataclass(frozen=True, slots=True)
class Motion:
    """A rigid motion between two sets of points."""

    transform: Array
    """(3,) ``T_a_b`` as x, y, theta."""
    covariance: Array
    """(3, 3) of the perturbation ``T_a_b * exp(xi)``."""
    pairs: NDArray[np.int64]
    """(P, 2) index of a, index of b; each at most once."""
    rms: float
    """Root mean square distance of the pairs [m]."""


def associate(
    a: ArrayLike, b: ArrayLike, compatible: ArrayLike | None = None, **options: Unpack[AssociationOptions]
) -> list[Motion]:
    """Find the motions that put most landmarks of b onto landmarks of a, without a first guess.

    Parameters
    ----------
    a, b
        (N, 2) and (M, 2) landmarks [m].
    compatible
        (N, M) mask of the pairs that may be formed, from descriptors say; all when left out.
    **options
        See :class:`AssociationOptions`.

    Returns
    -------
    list
        Motions that differ, most pairs first; empty when nothing pairs ``min_pairs``.

    Raises
    ------
    ValueError
        If an option is unknown or out of its range, points are not (N, 2) and finite, or the mask is not (N, M).
    """
    of_a, of_b = _points("a", a), _points("b", b)
    mask = None if compatible is None else np.ascontiguousarray(compatible, dtype=np.bool_)
    if mask is not None and mask.shape != (len(of_a), len(of_b)):
        raise ValueError(f"compatible has shape {mask.shape}: it must be {(len(of_a), len(of_b))}")
    found = _core.associate(of_a, of_b, mask, json.dumps(options))
    return [_motion(x, covariance, np.array(pairs), rms) for x, pairs, covariance, rms in found]


def rigid_fit(a: ArrayLike, b: ArrayLike, least_sigma: float = 0.01) -> Motion | None:
    """Fit the rigid motion that takes points b onto points a, row by row, by least squares.

    Parameters
    ----------
    a, b
        (N, 2) points [m].
    least_sigma
        Least standard deviation of a coordinate of a pair, for the covariance [m].

    Returns
    -------
    Motion or None
        None for fewer than two pairs or points b that coincide.

    Raises
    ------
    ValueError
        If the points are not (N, 2), finite and as many.
    """
    of_a, of_b = _points("a", a), _points("b", b)
    if len(of_a) != len(of_b):
        raise ValueError(f"a has {len(of_a)} points and b {len(of_b)}: they must be paired")
    fit = _core.rigid_fit(of_a, of_b, least_sigma)
    rows = np.repeat(np.arange(len(of_a))[:, None], 2, axis=1)
    return None if fit is None else _motion(fit[0], fit[1], rows, fit[2])


def _motion(
    transform: tuple[float, float, float], covariance: list[float], pairs: NDArray[np.int64], rms: float
) -> Motion:
    return Motion(np.array(transform), np.array(covariance).reshape(3, 3), pairs, rms)


def _beams(geometry: BeamGeometry) -> tuple[float, float, float, float]:
    return geometry.angle_min, geometry.angle_increment, geometry.range_min, geometry.range_max


def _poses(keypoints: Keypoints, radius: float | None) -> Array:
    radii = keypoints.radius if radius is None else np.full(len(keypoints), radius)
    return np.column_stack([keypoints.point, keypoints.orientation, radii])


def _vector(name: str, values: ArrayLike) -> Array:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}: it must have one dimension")
    return array


def _points(name: str, values: ArrayLike) -> Array:
    array = np.ascontiguousarray(values, dtype=np.float64)
    array = array.reshape(-1, 2) if array.size == 0 else array
    if array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise ValueError(f"{name} has shape {array.shape}: it must be (N, 2) and finite")
    return array

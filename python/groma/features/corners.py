"""Corners of laser scans: find them, describe them, tell places apart by them, pair them between two maps.

Source: Kallasi, Rizzini, Caselli, "Fast keypoint features from laser scanner for robot localization and mapping",
IEEE RA-L 1(1), 2016 (FALKO, OC, BSC, CGH); Kallasi, Rizzini, IROS 2016 (GLAROT). Formulas: docs/theory/features.md.
Keypoints and points are in the laser frame, metres and radians. Settings are given by name; their defaults are
:func:`defaults`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma._core import Keypoints as Keypoints
from groma.features.association import Motion as Motion
from groma.features.association import associate as associate
from groma.features.association import rigid_fit as rigid_fit
from groma.features.association import to_points
from groma.features.options import AssociationOptions, FalkoOptions, GlarotOptions, OcOptions
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry


def defaults() -> tuple[FalkoOptions, GlarotOptions, AssociationOptions]:
    """Return the default settings of :func:`falko`, :class:`Signature` and :func:`associate`."""
    falko, glarot, association = (json.loads(text) for text in _core.feature_defaults())
    return falko, glarot, association


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

    Examples
    --------
    A scanner in the middle of a room of 6 x 4 m, all round in steps of half a degree:

    >>> bearing = np.deg2rad(np.arange(720) / 2)
    >>> ranges = np.minimum(3 / np.abs(np.cos(bearing)), 2 / np.maximum(np.abs(np.sin(bearing)), 1e-9))
    >>> geometry = BeamGeometry(0.0, np.deg2rad(0.5), 0.0, 0.1, 30.0)
    >>> corners = falko(ranges, geometry)
    >>> np.round(corners.point, 1).tolist()
    [[3.0, 2.0], [-3.0, 2.0], [-3.0, -2.0], [3.0, -2.0]]
    """
    return _detector("falko", geometry, **options).detect(_vector("a scan", ranges))


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

    Examples
    --------
    >>> bearing = np.deg2rad(np.arange(720) / 2)
    >>> ranges = np.minimum(3 / np.abs(np.cos(bearing)), 2 / np.maximum(np.abs(np.sin(bearing)), 1e-9))
    >>> geometry = BeamGeometry(0.0, np.deg2rad(0.5), 0.0, 0.1, 30.0)
    >>> [len(corners) for corners in falko_batch([ranges, np.full(720, np.nan)], geometry)]
    [4, 0]
    """
    return _detector("falko", geometry, **options).detect_all(_vectors(scans))


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

    Examples
    --------
    >>> bearing = np.deg2rad(np.arange(720) / 2)
    >>> ranges = np.minimum(3 / np.abs(np.cos(bearing)), 2 / np.maximum(np.abs(np.sin(bearing)), 1e-9))
    >>> geometry = BeamGeometry(0.0, np.deg2rad(0.5), 0.0, 0.1, 30.0)
    >>> np.round(oc(ranges, geometry).point, 2).tolist()
    [[3.0, 2.0], [-3.0, 2.0], [-3.0, -2.0], [3.0, -2.0]]
    """
    return _detector("oc", geometry, **options).detect(_vector("a scan", ranges))


def oc_batch(
    scans: ArrayLike | Sequence[ArrayLike], geometry: BeamGeometry, **options: Unpack[OcOptions]
) -> list[Keypoints]:
    """Find the orthogonal corners of many scans, as :func:`falko_batch` does those of any angle."""
    return _detector("oc", geometry, **options).detect_all(_vectors(scans))


@lru_cache(maxsize=64)
def _detector(name: str, geometry: BeamGeometry, **options: object) -> _core.CornerDetector:
    """Return the detector of a scanner, which keeps its tables between scans."""
    return _core.CornerDetector(name, _beams(geometry), json.dumps(options))


def _vectors(scans: ArrayLike | Sequence[ArrayLike]) -> list[Array]:
    return [_vector("a scan", scan) for scan in scans]  # type: ignore[union-attr]


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

    Examples
    --------
    Corners opposite to each other in a room look alike; they are turned before they are described.

    >>> bearing = np.deg2rad(np.arange(720) / 2)
    >>> ranges = np.minimum(3 / np.abs(np.cos(bearing)), 2 / np.maximum(np.abs(np.sin(bearing)), 1e-9))
    >>> geometry = BeamGeometry(0.0, np.deg2rad(0.5), 0.0, 0.1, 30.0)
    >>> cells = bsc(ranges, geometry, falko(ranges, geometry))
    >>> int(bsc_distance(cells, cells)[0, 2])
    0
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

    Examples
    --------
    >>> bearing = np.deg2rad(np.arange(720) / 2)
    >>> ranges = np.minimum(3 / np.abs(np.cos(bearing)), 2 / np.maximum(np.abs(np.sin(bearing)), 1e-9))
    >>> geometry = BeamGeometry(0.0, np.deg2rad(0.5), 0.0, 0.1, 30.0)
    >>> shares = cgh(ranges, geometry, falko(ranges, geometry))
    >>> float(cgh_distance(shares, shares)[0, 2])
    0.0
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

    Examples
    --------
    >>> landmarks = np.array([[0.0, 0.0], [5.0, 1.0], [2.0, 7.0], [-3.0, 4.0]])
    >>> turned = landmarks @ np.array([[0.0, 1.0], [-1.0, 0.0]])  # by a quarter turn
    >>> distance, rotation = Signature(landmarks).distance(Signature(turned))
    >>> distance < 0.01, round(rotation, 2)
    (True, 1.57)
    """

    def __init__(self, points: ArrayLike, **options: Unpack[GlarotOptions]) -> None:
        self._core = _core.GlarotSignature(to_points("points", points), json.dumps(options))

    def distance(self, other: Signature) -> tuple[float, float]:
        """Distance, 0 to 1, and the rotation that takes the points of self onto those of other, modulo pi [rad]."""
        return self._core.distance(other._core)

    def distance_unturned(self, other: Signature) -> float:
        """Distance, 0 to 1, without turning either (GLARE): for maps whose headings are known."""
        return self._core.distance_unturned(other._core)


class SignatureIndex:
    """Signatures, of which the nearest to a given one are found exactly.

    All are to be made with the same options: one with other bins than the first keeps its place and is never found.

    Examples
    --------
    >>> index = SignatureIndex()
    >>> places = [Signature(np.array([[0, 0], [x, 1], [2, 7.0]])) for x in (2.0, 5.0, 9.0)]
    >>> [index.add(place) for place in places]
    [0, 1, 2]
    >>> [place for place, distance, rotation in index.query(places[1], k=2)][0]
    1
    """

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

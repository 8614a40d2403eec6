"""Pair the landmarks of two maps and find the rigid motion between them.

Every method proposes motions; all are refined by one-to-one pairing and least squares in turns, so that a
:class:`Motion` means the same whatever found it. Formulas and sources: docs/theory/features.md.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.features.options import AssociationOptions
from groma.nouns.arrays import Array

Method = Literal["exhaustive", "nearest", "hough", "clique", "ransac"]


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
    complete: bool = True
    """False where the search for it was cut short, so that a better motion may exist."""


def associate(
    a: ArrayLike,
    b: ArrayLike,
    compatible: ArrayLike | None = None,
    *,
    method: Method = "exhaustive",
    prior: ArrayLike | None = None,
    seed: int = 0,
    draws: int = 2000,
    max_steps: int = 20_000_000,
    **options: Unpack[AssociationOptions],
) -> list[Motion]:
    """Find the motions that put most landmarks of b onto landmarks of a.

    Parameters
    ----------
    a, b
        (N, 2) and (M, 2) landmarks [m].
    compatible
        (N, M) mask of the pairs that may be formed, from descriptors say; all when left out.
    method
        ``exhaustive`` tries the motions of all pairs of equal length, ``ransac`` draws some, ``hough`` votes on a
        grid of motions, ``clique`` finds the most correspondences that agree in their distances (one motion),
        ``nearest`` takes mutual nearest neighbours at a prior (one motion). Only the last needs a first guess.
    prior
        (3,) first guess of ``T_a_b`` as x, y, theta, for ``nearest``.
    seed, draws
        Of ``ransac``: the same seed gives the same motions.
    max_steps
        After as many steps ``clique`` takes the best so far, with ``complete`` False.
    **options
        See :class:`AssociationOptions`.

    Returns
    -------
    list
        Motions that differ, most pairs first; empty when nothing pairs ``min_pairs``.

    Raises
    ------
    ValueError
        If the method or an option is unknown or out of its range, points are not (N, 2) and finite, the mask is not
        (N, M), or the prior is missing, given for another method, or not (3,) and finite.

    Examples
    --------
    >>> b = np.array([[0.0, 0.0], [5.0, 1.0], [2.0, 7.0], [-3.0, 4.0], [8.0, -2.0]])
    >>> a = b @ np.array([[0.0, 1.0], [-1.0, 0.0]]) + [10.0, 0.0]  # a quarter turn, and 10 m along x
    >>> best = associate(a, b)[0]
    >>> len(best.pairs), np.round(best.transform, 3).tolist()
    (5, [10.0, 0.0, 1.571])
    """
    of_a, of_b = to_points("a", a), to_points("b", b)
    mask = None if compatible is None else np.ascontiguousarray(compatible, dtype=np.bool_)
    if mask is not None and mask.shape != (len(of_a), len(of_b)):
        raise ValueError(f"compatible has shape {mask.shape}: it must be {(len(of_a), len(of_b))}")
    settings: dict[str, object] = {"method": method}
    settings |= {"ransac": {"seed": seed, "draws": draws}, "clique": {"max_steps": max_steps}}.get(method, {})
    if method == "nearest" or prior is not None:
        settings["prior"] = _prior(method, prior)
    found, complete = _core.associate(of_a, of_b, mask, json.dumps(settings), json.dumps(options))
    return [_motion(x, covariance, np.array(pairs), rms, complete) for x, pairs, covariance, rms in found]


def _prior(method: str, prior: ArrayLike | None) -> list[float]:
    """Check that a prior is given where, and only where, it is needed."""
    if method != "nearest":
        raise ValueError(f"method {method!r} takes no prior: leave it out, or use method 'nearest'")
    if prior is None:
        raise ValueError("method 'nearest' needs a prior: give x, y, theta of T_a_b")
    array = np.asarray(prior, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ValueError(f"prior has shape {array.shape}: it must be (3,) and finite")
    values: list[float] = array.tolist()
    return values


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
    of_a, of_b = to_points("a", a), to_points("b", b)
    if len(of_a) != len(of_b):
        raise ValueError(f"a has {len(of_a)} points and b {len(of_b)}: they must be paired")
    fit = _core.rigid_fit(of_a, of_b, least_sigma)
    rows = np.repeat(np.arange(len(of_a))[:, None], 2, axis=1)
    return None if fit is None else _motion(fit[0], fit[1], rows, fit[2])


def _motion(
    transform: Sequence[float],
    covariance: list[float],
    pairs: NDArray[np.int64],
    rms: float,
    complete: bool = True,
) -> Motion:
    return Motion(np.array(transform), np.array(covariance).reshape(3, 3), pairs, rms, complete)


def to_points(name: str, values: ArrayLike) -> Array:
    """Convert to (N, 2) points; ValueError, with the name, if the values are none."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    array = array.reshape(-1, 2) if array.size == 0 else array
    if array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise ValueError(f"{name} has shape {array.shape}: it must be (N, 2) and finite")
    return array

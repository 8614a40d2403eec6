"""What a map result amounts to, in numbers: the content of metrics.json, and what the verdict is based on.

drift                 || p_tracked(t) - p_final(t) ||: what loop closure took away; the same for the odometry alone
residual              residual of a closure after optimisation
chi_square_per_dof    of an edge: squared Mahalanobis residual / 3, in the mean over the edges of a kind; of the graph:
                      sum over all edges / (3 (edges - nodes + 1)). Near 1 the stated uncertainties are consistent, far
                      above 1 they are too small, far below too large.
sigma                 of a node relative to the first: root of the largest eigenvalue of the position block, and of the
                      heading variance
"""

from __future__ import annotations

import numpy as np

from groma import _core
from groma.mapping.result import Closure, MapResult, PoseGraph
from groma.nouns.arrays import Array

Figure = float | int | None


def path_length(poses: Array) -> Array:
    """Return the length of the path up to each pose (N,) [m]."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    return np.concatenate([[0.0], np.cumsum(steps)])


def drift(poses: Array, final: Array) -> Array:
    """Return the distance between two estimates of each position (N,) [m]; NaN where one is missing."""
    apart: Array = np.hypot(*(poses[:, :2] - final[:, :2]).T)
    return apart


def node_sigmas(graph: PoseGraph) -> tuple[Array, Array]:
    """Return the standard deviations of the nodes: position in the worst direction (N,) [m], heading (N,) [rad]."""
    return _core.planar_sigmas(np.ascontiguousarray(graph.covariances))


def accepted(result: MapResult) -> list[Closure]:
    """Return the closures that hold the map together."""
    return [closure for closure in result.closures if closure.accepted]


def rejected(result: MapResult) -> list[Closure]:
    """Return the closures that were turned down."""
    return [closure for closure in result.closures if not closure.accepted]


def map_figures(result: MapResult) -> dict[str, Figure | dict[str, Figure]]:
    """Return all figures of a result by name; None where there is nothing to measure."""
    sigma_m, sigma_rad = node_sigmas(result.graph)
    height, width = result.grid.cells.shape
    kinds = result.graph.kinds
    edges: dict[str, Figure] = {kind: kinds.count(kind) for kind in sorted(set(kinds))}
    return {
        "poses": len(result.trajectory),
        "duration_s": _largest(result.trajectory_stamps - result.trajectory_stamps[:1]),
        "path_m": _largest(path_length(result.trajectory)),
        "nodes": len(result.graph.poses),
        "edges": edges,
        "landmarks": len(result.landmarks.positions),
        "weak_spots": len(result.weak),
        "map_width_m": _stable(width * result.grid.resolution),
        "map_height_m": _stable(height * result.grid.resolution),
        "map_resolution_m": _stable(result.grid.resolution),
        "cells_occupied": int(np.count_nonzero(result.grid.cells >= 65)),
        "cells_free": int(np.count_nonzero((result.grid.cells >= 0) & (result.grid.cells < 65))),
        "drift_odometry_max_m": _largest(drift(result.odometry, result.trajectory)),
        "drift_tracked_max_m": _largest(drift(result.tracked, result.trajectory)),
        "sigma_position_max_m": _largest(sigma_m),
        "sigma_heading_max_deg": _largest(np.degrees(sigma_rad)),
        "chi_square_per_dof": _chi_squares(result.graph),
        "counts": {key: _stable(value) for key, value in sorted(result.counts.items())},
    } | _closure_figures(result)


def _closure_figures(result: MapResult) -> dict[str, Figure | dict[str, Figure]]:
    good = accepted(result)
    residual = np.array([closure.residual_m for closure in good])
    return {
        "closures_accepted": len(good),
        "closures_rejected": len(result.closures) - len(good),
        "closure_residual_median_m": _stable(float(np.median(residual))) if good else None,
        "closure_residual_max_m": _largest(residual),
        "closure_residual_max_deg": _largest(np.degrees([closure.residual_rad for closure in good])),
        "closure_correction_max_m": _largest(np.array([closure.correction_m for closure in good])),
    }


def _chi_squares(graph: PoseGraph) -> dict[str, Figure]:
    kinds = np.array(graph.kinds)
    means = {str(kind): graph.chi_squares[kinds == kind].mean() / 3 for kind in np.unique(kinds)}
    freedom = 3 * (len(graph.pairs) - len(graph.poses) + 1)
    total = graph.chi_squares.sum() / freedom if freedom > 0 else np.nan
    return {kind: _stable(value) for kind, value in {"graph": total, **means}.items()}


def _largest(values: Array) -> Figure:
    finite = np.abs(values[np.isfinite(values)])
    return _stable(finite.max()) if len(finite) else None


def _stable(value: float) -> Figure:
    """Return a figure with 9 digits: what two processors may disagree on is rounded away."""
    if not np.isfinite(value):
        return None
    return int(value) if isinstance(value, int) else float(f"{value:.9g}")

"""What the map of a camera network amounts to in numbers: the content of metrics.json.

sigma                 of a position: along its worst direction; of a rotation: about its worst axis
chi_square_per_dof    of corners: sum of squares in standard deviations / (coordinates - unknowns); of a camera:
                      / (coordinates - 6 views); of odometry and floor: / number. Near 1 the stated sigmas are
                      consistent.
honesty_factor        root of the corners' chi_square_per_dof: by how much their sigma would have to grow to be 1
"""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from groma import _core
from groma.nouns.network import MappedCamera, NetworkMap

Figure = float | int | None


def sigma_position(camera: MappedCamera) -> float:
    """Return the standard deviation of a position along its worst direction [m]."""
    return _core.pose_sigmas(camera.covariance)[0]


def sigma_rotation(camera: MappedCamera) -> float:
    """Return the standard deviation of a rotation about its worst axis [rad]."""
    return _core.pose_sigmas(camera.covariance)[1]


def current(network: NetworkMap) -> list[MappedCamera]:
    """Return the cameras where they are now."""
    return [camera for camera in network.cameras if camera.current]


def network_figures(network: NetworkMap) -> dict[str, object]:
    """Return all figures, by name."""
    verdicts = Counter(network.views.verdicts)
    fused = network.views.nis[[v in ("taken", "rejected") for v in network.views.verdicts]]
    return {
        "cameras": {camera.name: _camera(camera) for camera in current(network)},
        "cameras_mapped": len(current(network)),
        "cameras_not_mapped": list(network.unseen),
        "cameras_moved": sorted(name for name, _, _ in network.moved),
        "stops": len(network.halt_stamps),
        "views": {verdict: verdicts[verdict] for verdict in sorted(verdicts)},
        "views_in_the_map": len(network.views.used),
        "path_m": network.path_length,
        "odometry_error_at_the_end_m": network.odometry_error,
        "largest_sigma_position_m": max((sigma_position(c) for c in current(network)), default=None),
        "largest_sigma_rotation_rad": max((sigma_rotation(c) for c in current(network)), default=None),
        "corner_chi_square_per_dof": _number(network.corner_chi_square),
        "honesty_factor": _number(math.sqrt(network.corner_chi_square)),
        "odometry_chi_square_per_dof": _ratio(network.residuals["odometry"]),
        "floor_chi_square_per_dof": _ratio(network.residuals["floor"]),
        "filter_nis_per_dof": _number(float(np.mean(fused)) / 6) if len(fused) else None,
        "batch_steps": network.steps,
        "batch_converged": network.converged,
        "counts": dict(network.counts),
    }


def _camera(camera: MappedCamera) -> dict[str, Figure]:
    return {
        "sigma_position_m": sigma_position(camera),
        "sigma_rotation_rad": sigma_rotation(camera),
        "views": camera.views,
        "chi_square_per_dof": _number(camera.chi_square_per_dof),
    }


def _ratio(pair: tuple[float, int]) -> float | None:
    return _number(pair[0] / pair[1]) if pair[1] else None


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None

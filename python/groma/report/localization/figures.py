"""What localizing a drive amounts to, in numbers: the content of metrics.json, and what the verdict is based on.

nis_per_dof     sum of the squared innovations over the sum of their degrees of freedom: near 1 the filter is
consistent,
                well above 1 it is too sure of itself or the map is wrong, below 1 it is cautious
nis_inside_95   share of the scans whose squared innovations lie in the middle 95 % of a chi-square
matched_share   paired observations over all observations
known_share     share of the scans at which the pose was known
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groma.localization.result import Localized
from groma.nouns.arrays import Array

Figure = float | int | None


def localization_figures(result: Localized) -> dict[str, Figure | dict[str, Figure]]:
    """Return all figures of a result by name; None where there is nothing to measure."""
    known = result.status != "lost"
    tracking = result.status == "tracking"
    return (
        {
            "scans": len(result.stamps),
            "duration_s": _stable(float(result.stamps[-1] - result.stamps[0])),
            "path_m": _stable(float(result.way[-1])),
            "known_share": _mean(known),
            "tracking_share": _mean(tracking),
            "found_after_m": None if result.found_after is None else _stable(result.found_after),
            "times_lost": int(result.counts.get("times_lost", 0)),
            "landmarks": len(result.used),
            "landmarks_used": int(np.count_nonzero(result.used)),
            "observed_per_scan": _mean(result.observed),
            "matched_per_scan": _mean(result.matched),
            "matched_share": _ratio(float(result.matched.sum()), float(result.observed.sum())),
            "sigma_position_median_m": _median(result.sigma_position[known]),
            "sigma_position_max_m": _largest(result.sigma_position[known]),
            "sigma_heading_median_deg": _median(np.degrees(result.sigma_heading[known])),
            "sigma_heading_max_deg": _largest(np.degrees(result.sigma_heading[known])),
            "weak_stretches": len(result.weak),
            "counts": {key: _stable(value) for key, value in sorted(result.counts.items())},
        }
        | _innovations(result)
        | _halts(result)
    )


def chi_square_shares(values: Array, dof: NDArray[np.int64]) -> Array:
    """Return the share of a chi-square that lies below each value, where there are degrees of freedom.

    They are even here (range and bearing): ``1 - exp(-x/2) sum_{k < dof/2} (x/2)^k / k!``.
    """
    held = dof > 0
    half, count = values[held] / 2, dof[held] // 2
    term, total = np.ones_like(half), np.zeros_like(half)
    for k in range(int(count.max(initial=0))):
        total += np.where(k < count, term, 0.0)
        term = term * half / (k + 1)
    shares: Array = 1 - np.exp(-half) * total
    return np.clip(shares, 0.0, 1.0)


def _innovations(result: Localized) -> dict[str, Figure]:
    shares = chi_square_shares(result.nis, result.dof)
    return {
        "nis_per_dof": _ratio(float(result.nis[result.dof > 0].sum()), float(result.dof.sum())),
        "nis_inside_95": _mean((shares > 0.025) & (shares < 0.975)),
    }


def _halts(result: Localized) -> dict[str, Figure]:
    return {
        "halts": len(result.halts),
        "halt_scatter_median_m": _median(np.array([halt.scatter_m for halt in result.halts])),
        "halt_sigma_median_m": _median(np.array([halt.sigma_m for halt in result.halts])),
    }


def _ratio(a: float, b: float) -> Figure:
    return _stable(a / b) if b > 0 else None


def _mean(values: NDArray[np.generic]) -> Figure:
    return _stable(float(np.mean(values.astype(np.float64)))) if len(values) else None


def _median(values: Array) -> Figure:
    return _stable(float(np.median(values))) if len(values) else None


def _largest(values: Array) -> Figure:
    finite = values[np.isfinite(values)]
    return _stable(float(finite.max())) if len(finite) else None


def _stable(value: float) -> Figure:
    """Return a figure with 9 digits: what two processors may disagree on is rounded away."""
    return float(f"{value:.9g}") if np.isfinite(value) else None

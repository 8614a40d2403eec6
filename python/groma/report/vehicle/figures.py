"""What a calibration amounts to, in numbers: the content of metrics.json, and what the pictures show."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from groma.nouns.arrays import Array
from groma.nouns.vehicle import Vehicle
from groma.vehicle.calibration import SensorMotions
from groma.vehicle.recording import CONFIDENCE, CalibratedVehicle

Figure = float | int | str | None


@dataclass(frozen=True, slots=True)
class Driven:
    """What each motion was, by the calibrated wheels."""

    path: Array
    """(m,) distance of the base, negative backward [m]."""
    speed: Array
    """(m,) its mean [m/s]."""
    turn: Array
    """(m,) mean curvature of the path [rad/m], 0 where there was none."""


def driven(result: CalibratedVehicle) -> Driven:
    """Return what each motion was."""
    path, turn = result.core.driven().T
    time = result.data.motions.end - result.data.motions.start
    curvature = np.divide(turn, path, out=np.zeros_like(turn), where=np.abs(path) > 1e-3)
    return Driven(path, path / time, curvature)


def calibration_figures(result: CalibratedVehicle) -> dict[str, object]:
    """Return all figures of a result by name; None where there is nothing to measure."""
    found = result.found
    held = found.held_out
    names = found.names
    return {
        "model": found.model,
        "motions": len(result.data.motions.start),
        "segments": result.data.segments.kind,
        "source": result.data.source,
        "parameters": {name: _stable(value) for name, value in sorted(found.parameters.items())},
        "estimated": list(names),
        "sigma": dict(zip(names, map(_stable, found.sigmas.tolist()), strict=True)),
        "confidence": CONFIDENCE,
        "half_width": {name: _stable(width) for name, width in result.half_widths.items()},
        "tolerance": {name: _stable(value) for name, value in sorted(result.tolerances.items())},
        "enough": None if not result.tolerances else result.verdict.enough,
        "covariance": [[_stable(x) for x in row] for row in found.covariance.tolist()],
        "correlation": [[_stable(x) for x in row] for row in found.correlation.tolist()],
        "chi_square": _stable(found.chi_square),
        "dof": found.dof,
        "noise_scale": _stable(found.noise_scale),
        "open_directions": [weak.words for weak in found.weak],
        "tests": {
            t.name: {"statistic": _stable(t.statistic), "dof": t.dof, "p": _stable(t.p_value)} for t in found.tests
        },
        "held_out": held
        and {
            "folds": held.folds,
            "position_median_m": _stable(held.position_median),
            "position_rms_m": _stable(held.position_rms),
            "heading_median_deg": _stable(math.degrees(held.heading_median)),
        },
        "counts": {key: value for key, value in sorted(result.data.counts.items()) if value},
    }


def motion_table(result: CalibratedVehicle) -> str:
    """Return the motions as CSV: what was measured, residual of it, what it counted."""
    motions: SensorMotions = result.data.motions
    what = driven(result)
    head = "start,end,x,y,theta,residual_x,residual_y,residual_theta,weight,path,speed,curvature\n"
    columns = [
        motions.start,
        motions.end,
        *motions.motion.T,
        *result.found.residuals.T,
        result.found.weights,
        what.path,
        what.speed,
        what.turn,
    ]
    lines = [",".join(f"{value:.9g}" for value in row) for row in np.column_stack(columns)[:, 2:].tolist()]
    stamps = [f"{a:.6f},{b:.6f}" for a, b in zip(motions.start.tolist(), motions.end.tolist(), strict=True)]
    return head + "".join(f"{a},{b}\n" for a, b in zip(stamps, lines, strict=True))


def shown_vehicle(result: CalibratedVehicle) -> Vehicle | None:
    """Return the vehicle for files; None where the drive does not determine a parameter."""
    return None if result.found.weak else result.vehicle


def _stable(value: float) -> Figure:
    """Return a figure with 9 digits: what two processors may disagree on is rounded away."""
    return float(f"{value:.9g}") if math.isfinite(value) else None

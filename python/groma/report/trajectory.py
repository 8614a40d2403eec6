"""How far a trajectory is from the truth: as numbers with stable names and as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groma.errors import UserError
from groma.evaluation.reference import ReferenceErrors, RelativeErrors
from groma.evaluation.relations import RelationErrors, Relations
from groma.io.trajectory import Trajectory
from groma.nouns.arrays import Array

Tree = dict[str, "Tree | float | int | dict[str, int]"]


def relation_figures(errors: RelationErrors) -> Tree:
    """Return the figures of the relations metric by name."""
    return {
        "relations_total": errors.total,
        "relations_evaluated": len(errors.translation),
        "times": errors.how,
        "worst_time_gap_s": errors.worst_gap,
        "translation_m": _moments(errors.translation),
        "rotation_deg": _moments(errors.rotation),
        "squared_translation_m2": _moments(errors.translation**2),
        "squared_rotation_deg2": _moments(errors.rotation**2),
    }


def reference_figures(errors: ReferenceErrors) -> Tree:
    """Return the figures of ATE and RPE by name."""
    lengths: Tree = {f"{length:g}": _relative(pairs) for length, pairs in errors.lengths.items()}
    return {
        "poses_total": errors.total,
        "poses_evaluated": len(errors.ate),
        "worst_time_gap_s": errors.worst_gap,
        "alignment": dict(zip(("x_m", "y_m", "theta_rad"), errors.alignment.tolist(), strict=True)),
        "ate_m": _moments(errors.ate),
        "rpe_frame": _relative(errors.frames),
        "rpe_length_m": lengths,
    }


def _relative(errors: RelativeErrors) -> Tree:
    return {"translation_m": _moments(errors.translation), "rotation_deg": _moments(errors.rotation)}


def _moments(values: Array) -> Tree:
    return {
        "count": len(values),
        "mean": float(values.mean()),
        "std": float(values.std(ddof=1)) if len(values) > 1 else 0.0,
        "rmse": float(np.sqrt(np.mean(values**2))),
        "median": float(np.median(values)),
        "max": float(values.max()),
    }


def check_associated(errors: RelationErrors, relations: Relations, estimate: Trajectory, path: Path) -> None:
    """Refuse a trajectory of which no pose belongs to a relation.

    Raises
    ------
    UserError
        In one line: both spans of time.
    """
    if not len(errors.translation):
        times, stamps = relations.times, estimate.stamps
        raise UserError(
            f"{path}: no relation has poses at both its times: the relations span {times.min():.3f} to "
            f"{times.max():.3f} s, the trajectory {stamps[0]:.3f} to {stamps[-1]:.3f} s; see --max-dt and --odometry"
        )


def relation_text(errors: RelationErrors) -> str:
    """Return the relations metric for a person."""
    t, r = errors.translation, errors.rotation
    how = ", ".join(f"{count} {name}" for name, count in errors.how.items())
    return "\n".join(
        [
            f"relations evaluated       {len(t)} of {errors.total}  (times: {how}; worst gap {errors.worst_gap:.3f} s)",
            f"translation error         {_mean_std(t, 3)} m",
            f"rotation error            {_mean_std(r, 2)} deg",
            f"squared translation error {_mean_std(t**2, 3)} m^2",
            f"squared rotation error    {_mean_std(r**2, 2)} deg^2",
            f"median {np.median(t):.3f} m {np.median(r):.2f} deg   max {t.max():.3f} m {r.max():.2f} deg",
        ]
    )


def _mean_std(values: Array, digits: int) -> str:
    std = values.std(ddof=1) if len(values) > 1 else 0.0
    return f"{values.mean():.{digits}f} +- {std:.{digits}f}"


def reference_text(errors: ReferenceErrors) -> str:
    """Return ATE and RPE for a person."""
    rows = [("per frame", errors.frames)] + [(f"over {length:g} m", pairs) for length, pairs in errors.lengths.items()]
    head = f"poses evaluated  {len(errors.ate)} of {errors.total}  (worst gap {errors.worst_gap:.3f} s)"
    ate = f"ATE              {_spread(errors.ate, 3)} m"
    return "\n".join([head, ate, *(_relative_text(name, pairs) for name, pairs in rows)])


def _relative_text(name: str, errors: RelativeErrors) -> str:
    return f"RPE {name:<12} {_spread(errors.translation, 3)} m\n{'':16} {_spread(errors.rotation, 2)} deg"


def _spread(values: Array, digits: int) -> str:
    rmse = np.sqrt(np.mean(values**2))
    figures = {"rmse": rmse, "mean": values.mean(), "median": np.median(values), "max": values.max()}
    return "  ".join(f"{name} {value:.{digits}f}" for name, value in figures.items())

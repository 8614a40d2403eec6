"""`groma evaluate trajectory`: the benchmark's numbers by relations, or ATE and RPE against a reference."""

from __future__ import annotations

import json as json_text
import math
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.evaluation.association import Rule
from groma.evaluation.reference import ReferenceErrors, RelativeErrors, evaluate_reference
from groma.evaluation.relations import RelationErrors, Relations, evaluate_relations, read_relations
from groma.io.trajectory import Trajectory, read_tum

Array = NDArray[np.float64]
Tree = dict[str, "Tree | float | int | dict[str, int]"]


def trajectory(
    estimate: Path,
    /,
    *,
    relations: Path | None = None,
    reference: Path | None = None,
    odometry: Path | None = None,
    assoc: Rule = "nearest",
    max_dt: float = 0.1,
    max_gap: float = 2.0,
    json: bool = False,
) -> None:
    """Say how far a trajectory is from the truth. All files may be gzipped.

    groma evaluate trajectory results/latest/trajectory.tum --relations intel.relations

    groma evaluate trajectory results/latest/trajectory.tum --reference truth.tum

    Parameters
    ----------
    estimate
        Trajectory to judge, TUM: stamp x y z qx qy qz qw.
    relations
        True relative poses: t_i t_j x y z roll pitch yaw (Kuemmerle et al. 2009).
    reference
        True trajectory, TUM; the estimate is aligned with it.
    odometry
        TUM; moves the nearest pose to the time of a relation that is further than --max-dt.
    assoc
        Which pose stands for a time: the nearest, or the one interpolated between the neighbours.
    max_dt
        Largest time to the nearest pose [s].
    max_gap
        Largest gap that is interpolated over [s].
    json
        Print all figures as JSON.
    """
    if (relations is None) == (reference is None):
        raise UserError("give either --relations or --reference")
    if odometry is not None and (relations is None or assoc != "nearest"):
        raise UserError("--odometry serves only --relations with --assoc nearest")
    if not (0 <= max_dt < math.inf and 0 <= max_gap < math.inf):
        raise UserError("--max-dt and --max-gap are seconds from 0")
    estimated = _read(estimate)
    if relations is not None:
        truth = read_relations(relations)
        odometry_read = _read(odometry) if odometry is not None else None
        by_relations = evaluate_relations(truth, estimated, odometry_read, assoc, max_dt, max_gap)
        _check(by_relations, truth, estimated, estimate)
        print(_json(relation_figures(by_relations)) if json else _relation_text(by_relations))
    elif reference is not None:
        by_reference = evaluate_reference(estimated, _read(reference), assoc, max_dt, max_gap)
        print(_json(reference_figures(by_reference)) if json else _reference_text(by_reference))


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


def _read(path: Path) -> Trajectory:
    read = read_tum(path)
    if read.skipped:
        print(f"{path}: {read.skipped} rows that are not finite or have no rotation were left out", file=sys.stderr)
    if read.repeated:
        print(f"{path}: {read.repeated} rows with the stamp of an earlier row were left out", file=sys.stderr)
    return read


def _check(errors: RelationErrors, relations: Relations, estimate: Trajectory, path: Path) -> None:
    if not relations.planar:
        print("the relations have height, roll or pitch; only x, y and yaw are compared", file=sys.stderr)
    if not len(errors.translation):
        times, stamps = relations.times, estimate.stamps
        raise UserError(
            f"{path}: no relation has poses at both its times: the relations span {times.min():.3f} to "
            f"{times.max():.3f} s, the trajectory {stamps[0]:.3f} to {stamps[-1]:.3f} s; see --max-dt and --odometry"
        )


def _json(figures: Tree) -> str:
    return json_text.dumps(figures, indent=2)


def _relation_text(errors: RelationErrors) -> str:
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


def _reference_text(errors: ReferenceErrors) -> str:
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

"""`groma evaluate trajectory`: the benchmark's numbers by relations, or ATE and RPE against a reference."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import cast

from groma.errors import UserError
from groma.evaluation.association import Matching, Rule
from groma.evaluation.reference import evaluate_reference
from groma.evaluation.relations import evaluate_relations, read_relations
from groma.io.left_out import left_out
from groma.io.trajectory import Trajectory, read_tum
from groma.nouns.findings import Finding
from groma.report.trajectory import check_associated, reference_figures, reference_text, relation_figures, relation_text
from groma.runs.run import Run
from groma.runs.tables import settings_of, typed

_NOT_PLANAR = "the relations have height, roll or pitch; only x, y and yaw are compared"


def trajectory(
    estimate: Path,
    /,
    *,
    relations: Path | None = None,
    reference: Path | None = None,
    odometry: Path | None = None,
    assoc: Rule | None = None,
    max_dt: float | None = None,
    max_gap: float | None = None,
    json: bool = False,
    config: Path | None = None,
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
        Which pose represents a time: the nearest (when left out), or the one interpolated between the neighbours.
    max_dt
        Largest time to the nearest pose [s]; 0.1 when left out.
    max_gap
        Largest gap that is interpolated over [s]; 2 when left out.
    json
        Print all figures as JSON.
    config
        TOML with a table [trajectory] (groma config prints it).
    """
    settings = settings_of("trajectory", config, assoc=assoc, max_dt=max_dt, max_gap=max_gap)
    matching = typed(Matching, settings, "trajectory")
    if (relations is None) == (reference is None):
        raise UserError("give either --relations or --reference")
    if odometry is not None and (relations is None or matching.assoc != "nearest"):
        raise UserError("--odometry serves only --relations with --assoc nearest")
    if not (0 <= matching.max_dt < math.inf and 0 <= matching.max_gap < math.inf):
        raise UserError("--max-dt and --max-gap are seconds from 0")
    with Run("evaluation", "evaluate trajectory", folder=False) as run:
        estimated = _read(run, estimate)
        if relations is not None:
            truth = read_relations(relations)
            if not truth.planar:
                run.note(Finding("assumption", _NOT_PLANAR))
            odometry_read = _read(run, odometry) if odometry is not None else None
            errors = evaluate_relations(truth, estimated, odometry_read, matching)
            check_associated(errors, truth, estimated, estimate)
            figures, told = relation_figures(errors), relation_text(errors)
        else:
            known = _read(run, cast(Path, reference))
            judged = evaluate_reference(estimated, known, matching)
            figures, told = reference_figures(judged), reference_text(judged)
        run.say(told)
        run.finish(cast(Mapping[str, object], figures), as_json=json)


def _read(run: Run, path: Path) -> Trajectory:
    read = read_tum(path)
    run.extend(left_out({f"rows of {path} that are no number or have no rotation": read.skipped}))
    run.extend(left_out({f"rows of {path} with the stamp of an earlier row": read.repeated}))
    return read

"""The run of a drive planned before one camera, into the folder of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from groma.nouns.detection import Detection
from groma.nouns.findings import Finding
from groma.nouns.poses import Pose
from groma.planning.camera import CameraPlan, Judged, Search, Stage, middle_of_view, plan_camera, ranked
from groma.planning.planned_camera import Asked
from groma.report.camera_plan.report import camera_plan_report, plan_verdict
from groma.runs.camera_plan_files import write_camera_plan, write_camera_waypoints
from groma.runs.run import Run
from groma.runs.tables import search_table


def plan_camera_into(
    run: Run, asked: Asked, stage: Stage, pose: Pose, search: Search, seen: Sequence[Detection]
) -> CameraPlan:
    """Plan a drive and finish the run with it."""
    given = {"mount": list(asked.mount), "start": list(pose), "target": stage.target.json()}
    run.settings = {"plan_camera": {**search_table(search), **given, "camera": asked.camera.json()}}
    plan = plan_camera(stage, pose, search, covariance=asked.covariance, seen=seen, token=run.token)
    ranking = ranked(stage, middle_of_view(stage, search), search.noise)
    if not plan.met:
        text = (
            f"{search.target:g} px are not reached: allow more floor (--depth, --side), other panels, or a larger "
            "--sigma"
        )
        run.note(Finding("goal-missed", text, values={"worst_pixel": (plan.end.worst, "px")}))
    write_camera_waypoints(run.path("waypoints.csv"), plan, asked.foot)
    write_camera_plan(run.path("plan.json"), stage.camera, plan, asked.foot)
    headline = plan_verdict(plan, search)
    run.finish(_figures(plan, ranking), headline, lambda out: camera_plan_report(stage, plan, ranking, search, out))
    return plan


def _figures(plan: CameraPlan, ranking: tuple[Judged, ...]) -> dict[str, object]:
    end = plan.end
    return {
        "met": plan.met,
        "worst_pixel_before": _stable(plan.worst_before),
        "worst_pixel_after": _stable(end.worst),
        "distance_m": _stable(end.length),
        "effort_m": _stable(end.effort),
        "odometry_sigma_m": _stable(math.sqrt(end.variance)),
        "looks": plan.looks,
        "panels_seen": sum(stop.views for stop in plan.stops),
        "panels_seen_before": plan.seen,
        "motions": {
            judged.motion: {
                "worst_pixel": _stable(judged.worst),
                "distance_m": _stable(judged.length),
                "effort_m": _stable(judged.effort),
                "degenerate": judged.degenerate,
            }
            for judged in ranking
        },
    }


def _stable(value: float) -> float:
    return float(f"{value:.9g}")

"""The run of a planned calibration drive: arcs as a table and as a picture, into the folder of a run."""

from __future__ import annotations

import base64

import numpy as np

from groma.nouns.arrays import Array
from groma.planning.vehicle import VehiclePlan
from groma.report.page import Html, section
from groma.report.run import plain_report
from groma.report.vehicle_plan import plan_picture
from groma.runs.run import Run


def plan_vehicle_into(run: Run, plan: VehiclePlan, floor: Array | None, words: str) -> None:
    """Finish a run with a plan."""
    run.write_text("plan.csv", to_csv(plan))
    plan_picture(plan, floor, run.path("plan.png"))
    run.say(to_table(plan))
    picture = base64.b64encode(run.path("plan.png").read_bytes()).decode()
    drawn = section("The arcs", Html(f'<img alt="the arcs on the floor" src="data:image/png;base64,{picture}">'))
    headline = f"{len(plan.path)} arcs, {plan.time:.0f} s with stops; {words}."
    run.finish(_figures(plan), headline, plain_report("plan vehicle", drawn))


def _figures(plan: VehiclePlan) -> dict[str, object]:
    return {
        "arcs": len(plan.path),
        "time_s": float(plan.time),
        "time_bound_s": float(plan.bound),
        "distance_m": float(np.abs(plan.path).sum()),
        "sigma": {name: float(sigma) for name, sigma in plan.sigmas.items()},
    }


def to_csv(plan: VehiclePlan) -> str:
    """Return a line an arc."""
    lines = ["steering_rad,path_m,speed_mps,turn_rad,start_x_m,start_y_m,start_heading_rad"]
    columns = (plan.steering, plan.path, plan.speed, plan.turn, *plan.start.T)
    lines += [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join(lines) + "\n"


def to_table(plan: VehiclePlan) -> str:
    """Return equal arcs in a row, with their number."""
    columns = (
        np.degrees(plan.steering),
        plan.path,
        np.degrees(plan.turn),
        plan.speed,
        plan.start[:, 0],
        plan.start[:, 1],
    )
    rows = np.column_stack([*columns, np.degrees(plan.start[:, 2])]).round(3)
    kinds, first, counts = np.unique(rows, axis=0, return_index=True, return_counts=True)
    lines = ["times  steering deg  path m  turn deg  speed m/s  from x, y m, heading deg"]
    for k in np.argsort(first):
        steering, path, turn, speed, x, y, heading = kinds[k]
        shown = f"{counts[k]:5d}  {steering:12.1f}  {path:6.2f}  {turn:8.0f}  {speed:9.2f}  "
        lines.append(shown + f"{x:.2f}, {y:.2f}, {heading:.0f}")
    lines += [f"{name}: sigma {sigma:.3g}" for name, sigma in plan.sigmas.items()]
    return "\n".join(lines)

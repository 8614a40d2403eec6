"""The report on a planned drive before one camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import groma
from groma.io.toml import to_toml
from groma.planning.camera import CameraPlan, Judged, Search, Stage, Stop
from groma.report.camera_plan.pictures import before_and_after, the_drive, the_gain
from groma.report.findings import findings_section
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.words import count, length, number, pixels, short

_FOOTER = "groma {}: the same input and settings give the same bytes."
_FILES = {
    "report.html": "this page",
    "waypoints.csv": "the views, one per line, with the predicted accuracy",
    "plan.json": "the same, with the covariances of the parameters before and after",
    "metrics.json": "the metrics of this page and more, for scripts",
    "run.toml": "settings, versions and the input's hash",
}
_LEAST_TURN = math.radians(0.5)
_LEAST_WAY = 1e-3
"""Shorter turns and lines are not listed [rad, m]."""


def plan_verdict(plan: CameraPlan, search: Search) -> str:
    """Return one sentence: what to drive, and what it gives."""
    end = plan.end
    if len(plan.stops) == 1 and plan.met:
        return f"Nothing to drive: the worst-pixel error is already {pixels(end.worst)} (1 σ)."
    if not any(stop.views for stop in plan.stops):
        return (
            "The camera detects none of the panels on this floor: their tags are too small in the image (less than "
            "8\N{NO-BREAK SPACE}px), turned away by more than 75°, or out of view."
        )
    driven = length(end.length) if end.length > _LEAST_WAY else "Turning on the spot"
    way = f"{driven} with {count(plan.looks, 'view')}"
    from_, to = pixels(plan.worst_before), pixels(end.worst)
    if plan.met:
        return f"{way} lowers the worst-pixel error from {from_} to {to}."
    why = f"at most {search.drives} drives" if end.leg + 1 >= search.drives else "no drive on this floor improves it"
    return f"{way} lowers the worst-pixel error from {from_} to {to}, not to {pixels(search.target)}: {why}."


def camera_plan_report(
    stage: Stage, plan: CameraPlan, ranking: Sequence[Judged], search: Search, outcome: Outcome
) -> str:
    """Return the page."""
    over = text("p", "groma plan camera", "over")
    header = Html(f"<header>{over}{text('h1', outcome.headline)}</header>")
    drive = [("final", "line", "the drive, a dot per view"), ("muted", "line", "ahead of the robot")]
    drive += [
        ("rejected", "bar", "foot of the camera"),
        ("line", "line", "sides of its view; dashed: the floor allowed"),
    ]
    gain = [("final", "line", "this drive"), ("accepted", "dash", "required"), ("ink", "dot", "common trajectories")]
    gain += [("rejected", "cross", "common, rejected by a calibration")]
    over_image = (
        "Standard deviation of the projection of a far point, in its worst direction; a rotation of the whole camera "
        "is removed."
    )
    parts = [
        header,
        facts(_facts(plan)),
        findings_section(outcome.findings),
        figure(the_drive(stage, plan, search), "Circle: start, square: end.", drive),
        section("Drive by drive", _legs(plan)),
        section(
            "What it gives", figure(the_gain(plan, ranking, search.target), "Lower and further left is better.", gain)
        ),
        figure(before_and_after(stage.camera, plan), over_image),
        section("Common trajectories for this camera", _ranking(stage, ranking)),
        section(
            "Files and settings",
            table(["file ", "what for "], _FILES.items()),
            details("Settings, versions, input", text("pre", to_toml(outcome.record))),
        ),
        Html("<footer>" + text("span", _FOOTER.format(groma.__version__)) + "</footer>"),
    ]
    return page("groma plan camera", parts)


def instruction(before: Stop, after: Sequence[Stop]) -> str:
    """Return a drive in words: turn, line, turn.

    Parameters
    ----------
    before
        Where the robot stands.
    after
        The views on the drive.
    """
    poses = [before.pose, *(stop.pose for stop in after)]
    words: list[str] = []
    turn = moved = 0.0
    for a, b in pairwise(poses):
        step = math.hypot(b[0] - a[0], b[1] - a[1])
        if step > 1e-6 and abs(turn) > _LEAST_TURN:
            words.append(_turn(turn))
            turn = 0.0
        ahead = (b[0] - a[0]) * math.cos(b[2]) + (b[1] - a[1]) * math.sin(b[2]) >= 0
        if step <= 1e-6:
            words += [_line(moved)] if moved else []
            moved = 0.0
            turn += math.remainder(b[2] - a[2], math.tau)
        else:
            moved += step if ahead else -step
    words += [_line(moved)] if moved else []
    words += [_turn(turn)] if abs(turn) > _LEAST_TURN else []
    return ", ".join(words)


def _turn(angle: float) -> str:
    return f"turn {number(abs(math.degrees(angle)), 0)}° {'left' if angle > 0 else 'right'}"


def _line(way: float) -> str:
    return f"{length(abs(way))} {'ahead' if way > 0 else 'back'}"


def _facts(plan: CameraPlan) -> list[tuple[str, str]]:
    end = plan.end
    return [
        ("worst pixel before", pixels(plan.worst_before)),
        ("worst pixel after", pixels(end.worst)),
        ("distance", length(end.length)),
        ("distance of the wheels, with turns", length(end.effort)),
        ("views", str(plan.looks)),
        ("odometry error added to the camera's position", length(math.sqrt(end.variance))),
    ]


def legs(plan: CameraPlan) -> list[tuple[Stop, list[Stop]]]:
    """Return where each drive begins, and its looks."""
    found: list[tuple[Stop, list[Stop]]] = []
    for before, stop in pairwise(plan.stops):
        if not found or found[-1][1][-1].leg != stop.leg:
            found.append((before, []))
        found[-1][1].append(stop)
    return found


def _legs(plan: CameraPlan) -> Html:
    rows = [
        [
            str(k + 1),
            instruction(before, after),
            f"{number(after[-1].pose[0], 2)}, {number(after[-1].pose[1], 2)}",
            number(math.degrees(after[-1].pose[2]), 0),
            str(sum(stop.views > 0 for stop in after)),
            short(after[-1].worst),
        ]
        for k, (before, after) in enumerate(legs(plan))
    ]
    return table(["no.", "drive ", "to x, y [m]", "heading [°]", "views", "worst pixel [px]"], rows)


def _ranking(stage: Stage, ranking: Sequence[Judged]) -> Html:
    focal = stage.camera.parameters[0]
    rows = [
        [
            judged.motion,
            short(judged.worst),
            "–" if judged.sigmas is None else number(100 * judged.sigmas[0] / focal, 2),
            number(judged.length, 1),
            number(judged.effort, 1),
            number(1000 * math.sqrt(judged.variance), 0),
            str(judged.views),
            "a calibration would be rejected" if judged.degenerate else "",
        ]
        for judged in ranking
    ]
    head = [
        "drive ",
        "worst pixel [px]",
        "σ fx [%]",
        "distance [m]",
        "wheels [m]",
        "odometry [mm]",
        "panels",
        "note ",
    ]
    note = (
        "With the given panels (stationary and one-panel use one), from nominal intrinsics; σ fx from the views only."
    )
    return Html(table(head, rows) + text("p", note, "note"))

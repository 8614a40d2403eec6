"""The figures of an evaluation of loop closure: with stable names, as tables of text, as a page with curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groma.evaluation.loops import RANKS, RIGHT_M, RIGHT_RAD, Answers, LoopEvaluation
from groma.evaluation.revisits import COMMON, NEAR_M
from groma.mapping.recognition import STAGES, recognition_defaults
from groma.report import page
from groma.report.drawing import ACCEPTED, FINAL, INK, LINE, MUTED, REJECTED, TRACKED, axes, drawn, sheet
from groma.report.features.report import aligned
from groma.report.findings import findings_section
from groma.report.outcome import Outcome

Tree = Mapping[str, object]
Table = tuple[list[str], list[list[str]]]

_CAPTION = (
    "Left: precision and recall as the threshold of one score falls; the dot is what was accepted. "
    "Right: the path as the reference has it, with the returns that were closed and those that were missed."
)
_KEYS = (
    ("muted", "line", "first place retrieved, by signature"),
    ("tracked", "line", "best motion, by corners paired"),
    ("final", "line", "verified motion, by overlap x share"),
    ("accepted", "dot", "accepted; return closed"),
    ("rejected", "dot", "return missed"),
)


def loop_figures(found: Sequence[LoopEvaluation]) -> Tree:
    """Return all figures by name."""
    protocol: Tree = {
        "revisit_distance_m": NEAR_M,
        "revisit_common_view": COMMON,
        "right_within_m": RIGHT_M,
        "right_within_rad": RIGHT_RAD,
    }
    return {"protocol": protocol, "settings": recognition_defaults(), "recordings": [_figures(one) for one in found]}


def loop_tables(found: Sequence[LoopEvaluation]) -> str:
    """Return the tables as text."""
    return "\n\n".join(f"{title}\n{aligned(*table)}" for title, table in _tables(found))


def loop_report(found: Sequence[LoopEvaluation], outcome: Outcome) -> str:
    """Return a self-contained page."""
    body = [
        page.text("h1", outcome.headline),
        findings_section(outcome.findings),
        page.text(
            "p",
            f"A return: at most {NEAR_M:g} m from an earlier scan with {100 * COMMON:g} % of the hits in common view. "
            f"A closure is right within {RIGHT_M:g} m and {math.degrees(RIGHT_RAD):g} degrees.",
        ),
    ]
    body += [page.section(title.capitalize(), page.table(*table)) for title, table in _tables(found)]
    body += [page.section(one.scans.name, page.figure(_curves(one), _CAPTION, _KEYS)) for one in found]
    return page.page("Loop closure by corners", body)


def _figures(one: LoopEvaluation) -> Tree:
    said = np.isfinite(one.accepted.score)
    return {
        "recording": one.scans.name,
        "poses": one.scans.source,
        "scans_total": one.scans.total,
        "scans": int(one.found.used.sum()),
        "scans_without_pose": one.scans.without_pose,
        "path_m": float(one.found.driven.max(initial=0.0)),
        "local_maps": len(one.found.end),
        "corners_per_local_map": float(np.mean(one.found.corners)) if len(one.found.corners) else None,
        "returns": int(one.returns.sum()),
        "closures_accepted": int(said.sum()),
        "closures_right": int(one.accepted.right.sum()),
        "precision": None if math.isnan(one.precision) else one.precision,
        "recall": one.recall,
        "error_m": _spread(one.errors[:, 0]),
        "error_rad": _spread(one.errors[:, 1]),
        "retrieval_recall_at": {str(k): recall for k, recall in one.retrieved.items()},
        "recall_at_precision_1": {name: answers.recall_without_error() for name, answers in _steps(one)},
        "curves": {name: _curve(answers) for name, answers in _steps(one)},
        "returns_by_fate": one.fate,
        "time_s": {stage: one.found.seconds[stage] for stage in STAGES},
    }


def _steps(one: LoopEvaluation) -> list[tuple[str, Answers]]:
    return [("retrieval", one.retrieval), ("association", one.association), ("verification", one.verification)]


def _curve(answers: Answers) -> Tree:
    score, precision, recall = answers.precision_recall()
    return {"threshold": score.tolist(), "precision": precision.tolist(), "recall": recall.tolist()}


def _spread(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Tree | None:
    return {"median": float(np.median(values)), "max": float(values.max())} if len(values) else None


def _tables(found: Sequence[LoopEvaluation]) -> list[tuple[str, Table]]:
    closed: Table = (
        ["recording ", "scans", "returns", "accepted", "right", "precision", "recall", "median", "worst"],
        [],
    )
    places: Table = (["recording ", *(f"first {k}" for k in RANKS)], [])
    fates: Table = (["recording ", "scans", "what became of them "], [])
    times: Table = (["recording ", *(f"{stage} ms" for stage in STAGES), "local maps"], [])
    tables: list[tuple[str, Table]] = [
        ("closures accepted", closed),
        ("returns with a right place among the candidates", places),
        ("what became of the returns", fates),
        ("time of the steps for one local map", times),
    ]
    for one in found:
        closed[1].append([one.scans.name, *_accepted(one)])
        places[1].append([one.scans.name, *(f"{recall:.3f}" for recall in one.retrieved.values())])
        fates[1].extend([one.scans.name, str(count), word] for word, count in one.fate.items())
        count = max(1, len(one.found.end))
        each = [f"{1e3 * one.found.seconds[stage] / count:.2f}" for stage in STAGES]
        times[1].append([one.scans.name, *each, str(len(one.found.end))])
    return tables


def _accepted(one: LoopEvaluation) -> list[str]:
    said, right = int(np.isfinite(one.accepted.score).sum()), int(one.accepted.right.sum())
    metres = [f"{f(one.errors[:, 0]):.3f} m" for f in (np.median, np.max)] if said else ["", ""]
    shares = ["" if math.isnan(one.precision) else f"{one.precision:.3f}", f"{one.recall:.3f}"]
    return [str(int(one.found.used.sum())), str(int(one.returns.sum())), str(said), str(right), *shares, *metres]


@drawn("Precision against recall, and where returns were closed and missed")
def _curves(one: LoopEvaluation) -> Figure:
    figure = sheet(3.2)
    _draw_precision(axes(figure, 0.55, 0.45, 3.0, 2.6), one)
    _draw_path(axes(figure, 4.1, 0.45, 3.0, 2.6), one)
    return figure


def _draw_precision(ax: Axes, one: LoopEvaluation) -> None:
    for (_, answers), colour in zip(_steps(one), (MUTED, TRACKED, FINAL), strict=True):
        _, precision, recall = answers.precision_recall()
        ax.plot(recall, precision, color=colour)
    if not math.isnan(one.precision):
        ax.plot([one.recall], [one.precision], "o", color=ACCEPTED, clip_on=False)
    ax.set(xlim=(0, 1), ylim=(0, 1.02), xlabel="recall", ylabel="precision")


def _draw_path(ax: Axes, one: LoopEvaluation) -> None:
    poses = one.scans.poses[one.found.used]
    answered = one.found.local_map
    closed = np.flatnonzero(one.accepted.right)
    hit = one.returns & np.isin(answered, closed)
    ax.plot(poses[:, 0], poses[:, 1], color=LINE, linewidth=0.8)
    for chosen, colour in ((one.returns & ~hit, REJECTED), (hit, ACCEPTED)):
        ax.plot(poses[chosen, 0], poses[chosen, 1], ".", color=colour, markersize=4)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="x [m]", ylabel="y [m]")
    ax.tick_params(color=INK)

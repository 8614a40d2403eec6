"""The figures of an evaluation of features: as numbers with stable names, as tables of text, as a page with curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groma.evaluation.feature_landmarks import MERGE_RADIUS
from groma.evaluation.feature_visibility import MARGIN
from groma.evaluation.features import (
    LEAST_M,
    MOST_M,
    SHIFT_M,
    TOLERANCES_M,
    WINDOW,
    FeatureEvaluation,
    Repeatability,
)
from groma.features.corners import defaults
from groma.report import page
from groma.report.drawing import FINAL, INK, LINE, MUTED, REJECTED, axes, drawn, sheet
from groma.report.findings import findings_section
from groma.report.outcome import Outcome

Tree = Mapping[str, object]

_LONGEST_M = 0.4
_MOST_SIGHTINGS = 15
_HEAD = ("recording ", "scans", "keypoints/scan", "seen once", "us/scan")
_WAYS = ("into later scans", "into earlier scans")


def feature_figures(found: Sequence[FeatureEvaluation], every: int) -> Tree:
    """Return all figures by name; every is the thinning of the scans."""
    protocol: Tree = {
        "every": every,
        "window_scans": WINDOW,
        "least_distance_m": LEAST_M,
        "most_distance_m": MOST_M,
        "occlusion_margin_m": MARGIN,
        "chance_shift_m": SHIFT_M,
        "merge_radius_m": MERGE_RADIUS,
    }
    return {"protocol": protocol, "falko": defaults()[0], "recordings": [_figures(one) for one in found]}


def feature_tables(found: Sequence[FeatureEvaluation]) -> str:
    """Return the tables as text."""
    counts, *ways = _tables(found)
    titled = [f"{title}\n{aligned(head, rows)}" for title, (head, rows) in zip(_WAYS, ways, strict=True)]
    return "\n\n".join([aligned(*counts), *(f"repeatability, keypoints predicted {text}" for text in titled)])


def feature_report(found: Sequence[FeatureEvaluation], every: int, outcome: Outcome) -> str:
    """Return a self-contained page."""
    counts, *ways = _tables(found)
    body = [
        page.text("h1", outcome.headline),
        findings_section(outcome.findings),
        page.text("p", f"Thinned to 1 scan of {every}; pairs {LEAST_M:g} to {MOST_M:g} m apart within {WINDOW} scans."),
        page.table(*counts),
    ]
    for title, (head, rows) in zip(_WAYS, ways, strict=True):
        body.append(page.section(f"Repeatability, keypoints predicted {title}", page.table(head, rows)))
    body += [page.section(one.scans.name, page.figure(_curves(one), _CAPTION, _KEYS)) for one in found]
    return page.page("Repeatability of FALKO corners", body)


_CAPTION = (
    "Left: share of the visible keypoints that are found again in later scans, by how near. "
    "Right: by how many scans landmarks were seen."
)
_KEYS = (("ink", "line", "raw"), ("rejected", "line", "by chance"), ("final", "line", "corrected"))


def _figures(one: FeatureEvaluation) -> Tree:
    return {
        "recording": one.scans.name,
        "poses": one.scans.source,
        "scans_total": one.scans.total,
        "scans": len(one.scans.scans),
        "scans_without_pose": one.scans.without_pose,
        "keypoints": one.keypoints,
        "keypoints_per_scan": one.keypoints_per_scan,
        "pairs": one.forward.pairs,
        "repeatability": _repeatability(one.forward),
        "repeatability_backward": _repeatability(one.backward),
        "landmarks": len(one.sightings),
        "landmarks_seen_once": int(np.count_nonzero(one.sightings == 1)),
        "ephemeral_share": one.ephemeral_share,
        "time_per_scan_s": one.seconds_per_scan,
        "threads": one.threads,
    }


def _repeatability(way: Repeatability) -> Tree:
    by_tolerance = {f"{eps:g}": _shares(way, eps) for eps in TOLERANCES_M}
    return {"visible": len(way.distance), "moved": len(way.moved), "tolerance_m": by_tolerance}


def _shares(way: Repeatability, eps: float) -> Tree:
    corrected = way.corrected(eps)
    told = None if math.isnan(corrected) else corrected  # JSON has no NaN
    return {"raw": way.raw(eps), "chance": way.chance(eps), "corrected": told}


def _tables(found: Sequence[FeatureEvaluation]) -> list[tuple[list[str], list[list[str]]]]:
    """Return head and rows of three tables: counts, forward, backward."""
    shares = [f"{what} {eps:g} m" for eps in TOLERANCES_M for what in ("raw", "chance", "corrected")]
    head = [_HEAD[0], "pairs", "visible", *shares]
    forward = [[one.scans.name, *_row(one.forward)] for one in found]
    backward = [[one.scans.name, *_row(one.backward)] for one in found]
    return [(list(_HEAD), [_counts(one) for one in found]), (head, forward), (head, backward)]


def _counts(one: FeatureEvaluation) -> list[str]:
    once = f"{100 * one.ephemeral_share:.1f} % of {len(one.sightings)}"
    per_scan = f"{one.keypoints_per_scan:.2f}"
    return [one.scans.name, str(len(one.scans.scans)), per_scan, once, f"{1e6 * one.seconds_per_scan:.1f}"]


def _row(way: Repeatability) -> list[str]:
    shares = [f(eps) for eps in TOLERANCES_M for f in (way.raw, way.chance, way.corrected)]
    return [str(way.pairs), str(len(way.distance)), *(f"{share:.3f}" for share in shares)]


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table as text: the first column to the left, the others to the right."""
    table = [[title.strip() for title in head], *rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in table
    )


@drawn("Repeatability by tolerance, and by how many scans landmarks were seen")
def _curves(one: FeatureEvaluation) -> Figure:
    figure = sheet(2.7)
    _draw_curves(axes(figure, 0.55, 0.45, 3.9, 2.1), one.forward)
    _draw_sightings(axes(figure, 5.1, 0.45, 2.0, 2.1), one)
    return figure


def _draw_curves(ax: Axes, way: Repeatability) -> None:
    eps = np.linspace(0, _LONGEST_M, 81)
    raw, chance = (np.searchsorted(np.sort(d), eps, "right") / len(d) for d in (way.distance, way.moved))
    corrected = np.divide(raw - chance, 1 - chance, out=np.full_like(raw, np.nan), where=chance < 1)
    for curve, colour in ((raw, INK), (chance, REJECTED), (corrected, FINAL)):
        ax.plot(eps, curve, color=colour)
    for tolerance in TOLERANCES_M:
        ax.axvline(tolerance, color=LINE, zorder=0)
    ax.set(xlim=(0, _LONGEST_M), ylim=(0, 1), xlabel="tolerance [m]", ylabel="repeatability")


def _draw_sightings(ax: Axes, one: FeatureEvaluation) -> None:
    counts = np.bincount(one.sightings.clip(max=_MOST_SIGHTINGS), minlength=_MOST_SIGHTINGS + 1)[1:]
    ax.bar(np.arange(1, _MOST_SIGHTINGS + 1), counts, color=[FINAL] + [MUTED] * (_MOST_SIGHTINGS - 1))
    ax.set(xticks=[1, 5, 10, _MOST_SIGHTINGS], xlabel="scans", ylabel="landmarks")
    ax.set_xticklabels(["1", "5", "10", f"{_MOST_SIGHTINGS}+"])

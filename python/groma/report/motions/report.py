"""The report on drives tried out before a camera: the table of the thesis, its ranking by pixels, the error study."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import groma
from groma.evaluation.motions import Varied, rms_band
from groma.io.toml import to_toml
from groma.nouns.camera import Camera
from groma.planning.camera import Tried
from groma.report.findings import findings_section
from groma.report.motions.pictures import LABELS, the_focal_length, the_worst_pixel
from groma.report.outcome import Outcome
from groma.report.page import Html, details, figure, page, section, table, text
from groma.report.words import count, number, pixels, short

_FOOTER = "groma {}: the same settings give the same bytes."
SHOWN = ("fx", "fy", "cx", "cy", "k1", "k2")
"""Parameters of the table: the others are zero, so that a share of them says nothing."""


def motions_verdict(tried: Mapping[str, Tried], runs: int) -> str:
    """Return one sentence: which drive is best, which are refused."""
    good = by_pixels(tried)
    if not good:
        return f"None of the trajectories calibrates this camera: all are rejected in {count(runs, 'trial')}."
    refused = [motion for motion, found in tried.items() if found.refused == runs]
    best, worst = good[0], tried[good[0]].worst
    line = f"The {best} trajectory gives the lowest worst-pixel error, {pixels(worst or math.nan)}"
    return f"{line}; {' and '.join(refused)} are rejected." if refused else f"{line}."


def by_pixels(tried: Mapping[str, Tried]) -> list[str]:
    """Return the drives that calibrate, the best worst pixel first."""
    good = {motion: found.worst for motion, found in tried.items() if found.worst is not None}
    return sorted(good, key=lambda motion: good[motion] or math.inf)


def motions_report(
    camera: Camera, tried: Mapping[str, Tried], studied: Sequence[Varied], runs: int, outcome: Outcome
) -> str:
    """Return the page."""
    over = text("p", "groma evaluate motions", "over")
    parts = [
        Html(f"<header>{over}{text('h1', outcome.headline)}</header>"),
        findings_section(outcome.findings),
        section("Scatter of calibrations", _deviations(camera, tried), text("p", _note(runs), "note")),
        section("By the worst pixel", _ranking(tried)),
        *([_study(studied)] if studied else []),
        section("Settings", details("Settings and versions", text("pre", to_toml(outcome.record)))),
        Html("<footer>" + text("span", _FOOTER.format(groma.__version__)) + "</footer>"),
    ]
    return page("groma evaluate motions", parts)


def shares(camera: Camera, tried: Tried, values: Sequence[float] | None) -> dict[str, float]:
    """Return standard deviations as percent of the means, those of `SHOWN`; empty when there are none."""
    if not values or not tried.mean:
        return {}
    at = {name: camera.names.index(name) for name in SHOWN if name in camera.names}
    return {name: 100 * values[k] / abs(tried.mean[k]) for name, k in at.items()}


def _note(runs: int) -> str:
    low, high = rms_band(max(runs - 1, 1))
    return (
        f"Standard deviation as percent of the mean over {count(runs, 'trial')}, in brackets as predicted from the "
        f"views. This is repeatability, not accuracy. The trials determine a standard deviation to {number(low, 2)} .. "
        f"{number(high, 2)} of its value (95 %)."
    )


def _deviations(camera: Camera, tried: Mapping[str, Tried]) -> Html:
    names = [name for name in SHOWN if name in camera.names]
    rows, means = [], []
    for motion, found in tried.items():
        got, promised = shares(camera, found, found.deviation), shares(camera, found, found.predicted)
        cells = [f"{_two(got[name])} ({_two(promised.get(name))})" if name in got else "–" for name in names]
        rows.append([motion, *cells, str(found.refused)])
        if found.mean:
            means.append([motion, *(f"{found.mean[camera.names.index(name)]:.4g}" for name in names)])
    head = [f"{name} [%]" for name in names]
    return Html(table(["drive ", *head, "refused"], rows) + details("Means", table(["drive ", *names], means)))


def _ranking(tried: Mapping[str, Tried]) -> Html:
    good = by_pixels(tried)
    rows = [
        [
            motion,
            _two(tried[motion].worst),
            _two(tried[motion].worst_predicted),
            str(tried[motion].views),
            tried[motion].reason or "",
        ]
        for motion in [*good, *(motion for motion in tried if motion not in good)]
    ]
    return table(["trajectory ", "worst pixel [px]", "predicted [px]", "panels", "why rejected "], rows)


def _study(studied: Sequence[Varied]) -> Html:
    keys = [("final", "line", "errors of calibrations, root mean square"), ("final", "band", "95 % band of that")]
    keys += [("ink", "dash", "predicted from the views")]
    note = (
        "One hand-held panel of 0.6 m at random poses; one factor is varied, the others are 20 views, 45°, 1.2 m, "
        "6 x 6 tags, the whole image."
    )
    rows = [
        [
            LABELS[point.what][0],
            f"{point.value * LABELS[point.what][1]:.3g}",
            *(_percent(value) for value in (point.found.focal, point.found.focal_promised)),
            *(_two(value) for value in (point.found.worst, point.found.worst_promised)),
            str(point.found.calibrated),
            str(point.found.refused),
        ]
        for point in studied
    ]
    head = ["varied ", "", "fx [%]", "predicted", "worst pixel [px]", "predicted", "calibrated", "rejected"]
    return section(
        "The error study",
        figure(the_focal_length(studied), note, keys),
        figure(
            the_worst_pixel(studied),
            "Panels in the middle of the image alone determine the focal length well, but not the projection at the "
            "corners of the image: compare by pixels.",
            keys,
        ),
        details("Figures", table(head, rows)),
    )


def _two(value: float | None) -> str:
    return "–" if value is None else short(value)


def _percent(share: float | None) -> str:
    return _two(None if share is None else 100 * share)

"""The report on a localized drive: one page that says whether to trust the poses, where not, and how it halts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from groma.io.toml import to_toml
from groma.localization.result import Localized
from groma.report.findings import findings_section
from groma.report.localization import pictures
from groma.report.localization.figures import localization_figures
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.words import angle, count, duration, length, number, place

ROWS = 60
"""Of a long table."""
AT_ONCE = 0.1
"""A start that took less way was found at once [m]."""

FILES = {
    "report.html": "this page",
    "trajectory.tum": "the trajectory: stamp x y z qx qy qz qw in the frame of the map (TUM format, evo)",
    "covariance.txt": "of every pose: stamp, then xx xy xt yy yt tt of its body-frame perturbation",
    "quality.csv": "of every scan: status, landmarks, squared innovations, standard deviations",
    "stops.csv": "every stop with its pose",
    "landmarks.json": "landmarks observed on this drive, in the frame of the map: for groma promote",
    "metrics.json": "the metrics of this page and more, for scripts",
    "run.toml": "settings, versions and the inputs' hashes",
}


def localization_report(result: Localized, outcome: Outcome) -> str:
    """Return the page.

    Parameters
    ----------
    result
        The localized drive.
    outcome
        Verdict, findings and what goes into run.toml.
    """
    run = outcome.record
    title = f"groma localize · {outcome.source}"
    over = Html(f"<header>\n{text('p', title, 'over')}\n{text('h1', outcome.headline)}")
    footer = f"groma {run.get('groma', '')}: the same input and settings give the same bytes."
    body = [
        over,
        Html(_key_facts(result) + "\n</header>"),
        findings_section(outcome.findings),
        _map(result),
        _along(result),
        _honesty(result),
        _halts(result),
        _weak(result),
        _files(run),
        Html(f"<footer>{text('p', footer)}</footer>"),
    ]
    return page(title, body)


def localization_verdict(result: Localized) -> str:
    """Return one sentence: whether the pose was known, its accuracy, how often it was lost."""
    after = result.found_after
    if after is None:
        return "The vehicle was never localized: no place of the map fits its scans"
    known = result.status != "lost"
    sigma = length(float(np.median(result.sigma_position[known])))
    found = "" if after == 0 else "found at once, " if after < AT_ONCE else f"found after {length(after)}, "
    lost = int(result.counts.get("times_lost", 0))
    losses = f"it was lost {count(lost, 'time')}" if lost else "it was never lost"
    share = 100 * float(np.mean(known))
    held = "for all scans" if share > 99.95 else f"for {number(share, 1)}\N{NO-BREAK SPACE}% of the scans"
    return f"The pose was {found}known {held} to {sigma} (σ, median), and {losses}"


def _key_facts(result: Localized) -> Html:
    figures = localization_figures(result)
    known = result.status != "lost"
    sigma = result.sigma_position[known]
    return facts(
        [
            ("driven", length(float(result.way[-1]))),
            ("in", duration(float(result.stamps[-1] - result.stamps[0]))),
            ("σ of position, median", length(float(np.median(sigma))) if len(sigma) else "–"),
            ("σ of position, largest", length(float(sigma.max())) if len(sigma) else "–"),
            ("landmarks per scan", number(float(np.mean(result.matched)), 1)),
            ("landmarks used", f"{np.count_nonzero(result.used)} of {len(result.used)}"),
            ("NIS per degree of freedom", _plain(figures["nis_per_dof"], 2)),
            ("halts", f"{len(result.halts)}"),
        ]
    )


def _map(result: Localized) -> Html:
    caption = (
        "The trajectory on the map. Landmarks in use are coloured; grey ones were never paired: they were removed, "
        "occluded or out of view."
    )
    keys = [
        ("final", "line", "the drive"),
        ("accepted", "dot", "corner, paired"),
        ("tracked", "dot", "reflector, paired"),
        ("muted", "dot", "never paired"),
        ("weak", "bar", "weakly constrained"),
        ("rejected", "ring", "halt"),
        ("ink", "ring", "start"),
        ("ink", "square", "end"),
    ]
    return section("The drive", figure(pictures.the_drive(result), caption, keys))


def _along(result: Localized) -> Html:
    caption = (
        "Standard deviations reported by the filter. The innovations below check them: on the dashed line the filter "
        "is consistent, well above it is overconfident or the place has changed."
    )
    keys = [("weak", "band", "weakly constrained")]
    return section("Along the drive", figure(pictures.along_the_drive(result), caption, keys))


def _honesty(result: Localized) -> Html:
    if not (result.dof > 0).any():
        return section("Consistency of the covariances", text("p", "Unknown: no landmark was paired."))
    figures = localization_figures(result)
    note = (
        f"The mean NIS per degree of freedom is {_plain(figures['nis_per_dof'], 2)}, and "
        f"{number(100 * float(str(figures['nis_inside_95'])), 0)}\N{NO-BREAK SPACE}% of the scans lie in "
        "the middle 95 % of a chi-square; a conservative filter has more below it, an overconfident one more above."
    )
    caption = (
        "If the assumptions of the filter are correct, every bar reaches the dashed line. Larger bars on the left: "
        "conservative; on the right: scans that do not fit the map."
    )
    return section("Consistency of the covariances", text("p", note), figure(pictures.innovations(result), caption))


def _halts(result: Localized) -> Html:
    if not result.halts:
        return section("Halts", text("p", "None: the vehicle never stopped for a second."))
    start = float(result.stamps[0])
    rows = [
        [
            str(k),
            f"{duration(halt.from_stamp - start)}–{duration(halt.to_stamp - start)}",
            f"({number(halt.pose[0], 3)}, {number(halt.pose[1], 3)})",
            angle(halt.pose[2]),
            length(halt.sigma_m),
            length(halt.scatter_m),
            number(halt.matched, 1),
        ]
        for k, halt in enumerate(result.halts[:ROWS], 1)
    ]
    note = (
        "Scatter is the root mean square variation of the pose during a stop: the noise of the stop, not its "
        "distance from the intended place."
    )
    head = ["no.", "when", "x, y [m]", "heading", "σ", "scatter", "landmarks"]
    return section("Halts", text("p", note), table(head, rows))


def _weak(result: Localized) -> Html:
    if not result.weak:
        return section("Weak stretches", text("p", "None: landmarks constrained every pose, and agreed."))
    start = float(result.stamps[0])
    worst = sorted(result.weak, key=lambda spot: -(spot.to_stamp - spot.from_stamp))
    rows = [
        [
            f"{duration(spot.from_stamp - start)}–{duration(spot.to_stamp - start)}",
            place(spot.xy),
            length(spot.sigma_m),
            spot.why,
        ]
        for spot in worst[:ROWS]
    ]
    return section("Weak stretches", table(["when", "at ", "σ", "why "], rows))


def _files(run: Mapping[str, object]) -> Html:
    rows = table(["file ", "what for "], FILES.items())
    return section("Files and settings", rows, details("Settings, versions, input", text("pre", to_toml(run))))


def _plain(value: object, digits: int) -> str:
    return number(value, digits) if isinstance(value, float) else "–"

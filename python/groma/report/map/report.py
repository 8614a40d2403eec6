"""The report on a map: one page that says whether to trust it, where not, and what every file is for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from groma.io.toml import to_toml
from groma.mapping.result import Closure, MapResult
from groma.report.findings import findings_section
from groma.report.map import pictures
from groma.report.map.figures import accepted, drift, node_sigmas, path_length, rejected
from groma.report.map.words import strain
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.words import angle, bearing, count, duration, length, number, place

_FOOTER = "groma {}: the same input and settings give the same bytes."

ROWS = 15
"""Of a long table; the worst come first."""

FILES = {
    "report.html": "this page",
    "trajectory.tum": "the trajectory: stamp x y z qx qy qz qw in the frame of the map (TUM format, evo)",
    "map.yaml, map.pgm": "the occupancy map for nav2 and others",
    "landmarks.json": "corners with covariances, to localize on",
    "graph.g2o": "the pose graph: nodes, edges, information",
    "metrics.json": "the metrics of this page and more, for scripts",
    "run.toml": "settings, versions and the input's hash",
}


def map_report(result: MapResult, outcome: Outcome) -> str:
    """Return the page.

    Parameters
    ----------
    result
        The map.
    outcome
        Verdict, findings and what goes into run.toml.
    """
    name, run = outcome.source, outcome.record
    over = Html(f"<header>\n{text('p', f'groma map · {name}', 'over')}\n{text('h1', outcome.headline)}")
    body = [
        over,
        Html(_key_facts(result) + "\n</header>"),
        findings_section(outcome.findings),
        _map(result),
        _before_and_after(result),
        _drift(result),
        _closures(result),
        _weak(result),
        _uncertainty(result),
        _counts(result),
        _files(run),
        Html(f"<footer>{text('p', _FOOTER.format(run.get('groma', '')))}</footer>"),
    ]
    return page(f"groma map · {name}", body)


def _key_facts(result: MapResult) -> Html:
    stamps, sigma_m = result.trajectory_stamps, node_sigmas(result.graph)[0]
    residuals = [closure.residual_m for closure in accepted(result)]
    return facts(
        [
            ("driven", length(float(path_length(result.trajectory)[-1]))),
            ("in", duration(stamps[-1] - stamps[0])),
            ("loops closed", f"{len(accepted(result))}"),
            ("closure residual, median", length(float(np.median(residuals))) if residuals else "–"),
            ("drift removed", length(_largest(drift(result.tracked, result.trajectory)))),
            ("largest σ of position", length(_largest(sigma_m))),
            ("landmarks", f"{len(result.landmarks.positions)}"),
            ("weak stretches", f"{len(result.weak)}"),
        ]
    )


def _map(result: MapResult) -> Html:
    caption = (
        f"Black: walls. White: observed floor. Grey: never observed. Cells of {length(result.grid.resolution)}. "
        "Doubled walls mean a loop that was not closed or closed wrongly. "
        "Bars mark weak stretches, along the weakly constrained direction; their numbers are those of the table below."
    )
    keys = [
        ("final", "line", "the drive"),
        ("ink", "ring", "start"),
        ("ink", "square", "end"),
        ("accepted", "line", "loop closure"),
        ("weak", "bar", "weakly constrained"),
    ]
    return section("The map", figure(pictures.the_map(result), caption, keys))


def _before_and_after(result: MapResult) -> Html:
    caption = (
        "All start at the same pose. The difference between the tracked and the final trajectory is the correction by "
        "loop closure."
    )
    keys = [("tracked", "line", "tracked, before loop closure"), ("final", "line", "final")]
    if np.isfinite(result.odometry).any():
        keys.insert(0, ("odometry", "dash", "odometry alone"))
    return section("Trajectory before and after", figure(pictures.before_and_after(result), caption, keys))


def _drift(result: MapResult) -> Html:
    caption = (
        "Drift that grows evenly is noise; a step is a slip, a jump of the odometry or a wrong match. "
        "The standard deviation is relative to the start: it grows away from it and shrinks where loops close."
    )
    keys = [("accepted", "tick", "a loop was closed"), ("weak", "band", "weakly constrained")]
    return section("Drift and uncertainty along the drive", figure(pictures.along_the_drive(result), caption, keys))


def _closures(result: MapResult) -> Html:
    if not result.closures:
        note = "No candidate for a loop closure: the drive never returned to a place, or the place was not recognised."
        return section("Loop closures", text("p", note))
    good, bad = accepted(result), rejected(result)
    caption = (
        "Correction and residual of each closure. Far below the dashed line: the map agrees with it. On the line: it "
        "does not, which for an accepted closure means a strained map. Values below 1 mm are drawn as 1 mm."
    )
    keys = [("accepted", "dot", f"accepted ({len(good)})"), ("rejected", "cross", f"rejected ({len(bad)})")]
    parts = [figure(pictures.closures(result), caption, keys)]
    if good:
        parts.append(_closure_table(result, sorted(good, key=strain, reverse=True), "Accepted"))
    if bad:
        parts += [_reasons(bad), _closure_table(result, sorted(bad, key=lambda c: -c.overlap), "Rejected")]
    return section("Loop closures", *parts)


def _reasons(bad: list[Closure]) -> Html:
    reasons = Counter(closure.reason for closure in bad).most_common()
    return text("p", f"{count(len(bad), 'closure')} rejected: " + "; ".join(f"{n} × {why}" for why, n in reasons) + ".")


def _closure_table(result: MapResult, group: list[Closure], title: str) -> Html:
    start = float(result.trajectory_stamps[0])
    why = ["why "] if title == "Rejected" else []
    head = ["from", "to", "at ", "overlap", "correction", "residual", "residual", *why]
    rows = [
        [
            duration(c.from_stamp - start),
            duration(c.to_stamp - start),
            place(c.to_xy),
            f"{number(100 * c.overlap, 0)}\N{NO-BREAK SPACE}%",
            length(c.correction_m),
            length(c.residual_m),
            angle(abs(c.residual_rad)),
            *([c.reason] if why else []),
        ]
        for c in group[:ROWS]
    ]
    order = "largest residual first" if title == "Accepted" else "largest overlap first"
    shown = f"all {len(group)}" if len(group) <= ROWS else f"{ROWS} of {len(group)}"
    return details(f"{title} closures, {shown}, {order}", table(head, rows))


def _weak(result: MapResult) -> Html:
    if not result.weak:
        return section("Weak stretches", text("p", "None: every registration was constrained in all directions."))
    start = float(result.trajectory_stamps[0])
    spots = pictures.worst_first(result.weak)
    rows = [
        [
            str(row),
            f"{duration(spot.from_stamp - start)}–{duration(spot.to_stamp - start)}",
            place(spot.xy),
            length(spot.sigma_m),
            bearing(spot.direction),
            spot.why,
        ]
        for row, spot in enumerate(spots[:ROWS], 1)
    ]
    note = (
        "Stretches where the scans do not constrain a direction; σ is the standard deviation of one registration along "
        "it, the direction is relative to the x axis of the map."
    )
    more = [text("p", f"The {ROWS} worst are shown; all are marked in the map.", "note")] if len(spots) > ROWS else []
    return section("Weak stretches", text("p", note), table(["no.", "when", "at ", "σ", "along", "why "], rows), *more)


def _uncertainty(result: MapResult) -> Html:
    kinds, chi = np.array(result.graph.kinds), result.graph.chi_squares
    rows = [
        [str(kind), str(len(values)), number(values.mean() / 3, 2), number(values.max() / 3, 1)]
        for kind in np.unique(kinds)
        for values in [chi[kinds == kind]]
    ]
    note = (
        "Squared residuals of the edges of the pose graph, divided by their covariance: the mean is 1 or less if the "
        "covariances are consistent, well above 1 if they are too small."
    )
    if any(strain(closure) > 1 for closure in accepted(result)):
        note += " Some closures are violated: see their table."
    head = ["edge ", "number", "mean χ²/3", "worst χ²/3"]
    return section("Consistency of the covariances", text("p", note), table(head, rows))


def _counts(result: MapResult) -> Html:
    rows = [[_words(key), _plain(value)] for key, value in result.counts.items()]
    return section("What was read", details("All counts", table(["what ", "number"], rows)))


def _files(run: Mapping[str, object]) -> Html:
    rows = table(["file ", "what for "], FILES.items())
    return section("Files and settings", rows, details("Settings, versions, input", text("pre", to_toml(run))))


def _largest(values: np.typing.NDArray[np.float64]) -> float:
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def _words(key: str) -> str:
    return key.replace("_", " ")


def _plain(value: float) -> str:
    return f"{value:,.0f}".replace(",", "\N{NARROW NO-BREAK SPACE}") if float(value).is_integer() else number(value, 3)

"""The report on a vehicle: accuracy, undetermined parameters, misfits of the model, what to paste."""

from __future__ import annotations

import math
from collections.abc import Mapping

from groma.io.robot_files import ros2_control, urdf_joint
from groma.io.toml import to_toml
from groma.report.findings import findings_section
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.vehicle import pictures
from groma.report.vehicle.figures import driven, shown_vehicle
from groma.report.vehicle.words import WORDS, amount, misfits, rows, verdict_words
from groma.report.words import angle, count, length, number
from groma.vehicle.recording import CalibratedVehicle

_FOOTER = "groma {}: the same input and settings give the same bytes."
FILES = {
    "report.html": "this page",
    "vehicle.toml": "the vehicle with its covariance: for groma map --vehicle and groma localize",
    "laser.urdf.xml": "the joint of the laser, for a URDF",
    "ros2_control.yaml": "parameters of the ros2_control controller",
    "motions.csv": "every motion: measurement, residual, weight",
    "metrics.json": "the metrics of this page and more, for scripts",
    "run.toml": "settings, versions and the input's hash",
}
_DIRECTIONS = [("final", "dot", "forward"), ("tracked", "dot", "backward"), ("ink", "cross", "outlier")]


def calibration_report(result: CalibratedVehicle, outcome: Outcome) -> str:
    """Return the page.

    Parameters
    ----------
    result
        The calibration.
    outcome
        Verdict, findings and what goes into run.toml.
    """
    run, name = outcome.record, outcome.source
    over = Html(f"<header>\n{text('p', f'groma calibrate vehicle · {name}', 'over')}")
    body = [
        over,
        text("h1", outcome.headline),
        Html(_key_facts(result) + "\n</header>"),
        findings_section(outcome.findings),
        _parameters(result),
        _next(result),
        _misfit(result),
        _drive(result),
        _correlation(result),
        _reading(result),
        *_paste(result),
        _files(result, run),
        Html(f"<footer>{text('p', _FOOTER.format(run.get('groma', '')))}</footer>"),
    ]
    return page(f"groma calibrate vehicle · {name}", body)


def _key_facts(result: CalibratedVehicle) -> Html:
    found, what = result.found, driven(result)
    held = found.held_out
    return facts(
        [
            ("model", found.model),
            ("motions", f"{len(result.data.motions.start)} ({result.data.segments.kind})"),
            ("driven", length(float(abs(what.path).sum()))),
            (
                "of it backward",
                f"{number(100 * float(-what.path[what.path < 0].sum()) / float(abs(what.path).sum()), 0)} %",
            ),
            ("residuals / stated noise", number(found.noise_scale, 2)),
            ("cross-validation error, median", length(held.position_median) if held else "–"),
            ("cross-validation heading, median", angle(held.heading_median) if held else "–"),
        ]
    )


def _parameters(result: CalibratedVehicle) -> Html:
    head = ["parameter ", "value", "95 % interval", *(["tolerance", "verdict "] if result.tolerances else [])]
    estimated = [row[: len(head)] for row in rows(result)]
    given = [
        [f"{WORDS[name]} (given)", amount(name, value, 0.0, result), "", "", ""][: len(head)]
        for name, value in result.found.fixed.items()
    ]
    note = (
        "95 % intervals by Student's distribution with the noise level of the residuals, for each parameter separately."
    )
    if result.found.correlated:
        note += " They account for correlated errors of neighbouring motions."
    return section("The vehicle", table(head, [*estimated, *given]), text("p", note, "note"))


def _next(result: CalibratedVehicle) -> Html:
    if result.found.weak:
        lines = [text("li", weak.words) for weak in result.found.weak]
        note = "The drive does not determine these, so no vehicle.toml was written. Drive what is named and run again."
        return section("Undetermined parameters", text("p", note), Html("<ul>" + "".join(lines) + "</ul>"))
    worst = max(
        result.half_widths, key=lambda name: result.half_widths[name] / (result.tolerances.get(name) or math.inf)
    )
    if not result.tolerances:
        note = "The drive determines all parameters. Give --tolerance to check whether that is accurate enough."
    elif result.verdict.enough:
        note = f"Nothing: all tolerances are met. The nearest to its tolerance is: {WORDS[worst]}."
    else:
        note = (
            f"{verdict_words(result)}. The farthest from its tolerance is: {WORDS[worst]}. Arcs to the left and right, "
            "forward and backward, with small and large steering angles, determine all parameters; groma plan vehicle "
            "finds the shortest set for your floor and tolerances."
        )
    return section("What to drive next", text("p", note))


def _misfit(result: CalibratedVehicle) -> Html:
    asked = [[t.name, number(t.statistic, 1), str(t.dof), _p(t.p_value), t.words] for t in result.found.tests]
    against = misfits(result)
    note = "The residuals are consistent with the model." if not against else "Misfit: " + "; ".join(against) + "."
    parts = [text("p", note), table(["test ", "χ²", "dof", "p", "result "], asked)]
    if held := result.found.held_out:
        told = (
            f"Cross-validation ({held.folds} folds): the median error of predicted motions is "
            f"{length(held.position_median)} and {angle(held.heading_median)}, "
            f"{length(held.position_rms)} rms without the worst tenth."
        )
        parts.append(text("p", told))
    captions = [
        ("along_the_drive", "A trend means that something changed during the drive: load, tyres, a clock."),
        (
            "by_turn",
            "A slope over the curvature means a wrong wheelbase or gain; a step between left and right a wrong offset.",
        ),
        ("by_speed", "A slope over the speed means a delay; a step between forward and backward an asymmetry."),
    ]
    for name, caption in captions:
        parts.append(figure(getattr(pictures, name)(result), f"Residual of every motion. {caption}", _DIRECTIONS))
    return section("Does the model fit?", *parts)


def _drive(result: CalibratedVehicle) -> Html:
    caption = (
        "Path of the laser by the calibrated wheels, and the concatenated measured motions. Both start at the same "
        "pose; their distance is the sum of the residuals."
    )
    keys = [("final", "line", "by the wheels"), ("rejected", "cross", "measured")]
    return section("The drive", figure(pictures.paths(result), caption, keys))


def _correlation(result: CalibratedVehicle) -> Html:
    names, matrix = result.found.names, result.found.correlation
    body = [
        [WORDS[name], *(number(float(x), 2) if k <= i else "" for k, x in enumerate(matrix[i]))]
        for i, name in enumerate(names)
    ]
    head = ["parameter ", *(str(k + 1) for k in range(len(names)))]
    note = "Near ±1, this drive hardly distinguishes two parameters. The covariance is in vehicle.toml."
    return section("Correlation", text("p", note), table(head, body))


def _reading(result: CalibratedVehicle) -> Html:
    outliers = int((~(result.found.weights >= 0.3)).sum())
    told = (
        f"Motions come from the {result.data.source}. {count(outliers, 'motion').capitalize()} got a low weight, "
        "as outliers."
    )
    return section("What was read", text("p", told))


def _paste(result: CalibratedVehicle) -> list[Html]:
    vehicle = shown_vehicle(result)
    if vehicle is None:
        return []
    return [section("To paste", text("pre", urdf_joint(vehicle)), text("pre", ros2_control(vehicle)))]


def _files(result: CalibratedVehicle, run: Mapping[str, object]) -> Html:
    written = FILES.items() if not result.found.weak else [item for item in FILES.items() if item[0] not in _OF_VEHICLE]
    rows_ = table(["file ", "what for "], written)
    return section("Files and settings", rows_, details("Settings, versions, input", text("pre", to_toml(run))))


_OF_VEHICLE = ("vehicle.toml", "laser.urdf.xml", "ros2_control.yaml")


def _p(value: float) -> str:
    return "< 0.0001" if value < 1e-4 else number(value, 4)

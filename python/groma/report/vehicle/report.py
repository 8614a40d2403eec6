"""The report on a vehicle: is it calibrated well enough, what is open, what speaks against the model, what to paste."""

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
    "motions.csv": "every motion: what was measured, what is left of it, what it counted",
    "metrics.json": "the figures of this page and more, for scripts",
    "run.toml": "settings, versions and the input's hash: what made these files",
}
_DIRECTIONS = [("final", "dot", "forward"), ("tracked", "dot", "backward"), ("ink", "cross", "hardly counts")]


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
            ("residuals over stated noise", number(found.noise_scale, 2)),
            ("held-out error, median", length(held.position_median) if held else "–"),
            ("held-out heading, median", angle(held.heading_median) if held else "–"),
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
        "Intervals are those of Student's distribution with the noise that the residuals show; they hold for each "
        "parameter by itself."
    )
    if result.found.correlated:
        note += " They allow for errors that neighbouring motions share."
    return section("The vehicle", table(head, [*estimated, *given]), text("p", note, "note"))


def _next(result: CalibratedVehicle) -> Html:
    if result.found.weak:
        lines = [text("li", weak.words) for weak in result.found.weak]
        note = (
            "What the drive leaves open has no value: no vehicle.toml was written. Drive what is named and run again."
        )
        return section("What is open", text("p", note), Html("<ul>" + "".join(lines) + "</ul>"))
    worst = max(
        result.half_widths, key=lambda name: result.half_widths[name] / (result.tolerances.get(name) or math.inf)
    )
    if not result.tolerances:
        note = "Every parameter is held by the drive. Give --tolerance to be told whether that is enough."
    elif result.verdict.enough:
        note = f"Nothing: all tolerances are met. The nearest to its tolerance is: {WORDS[worst]}."
    else:
        note = (
            f"{verdict_words(result)}. The farthest from its tolerance is: {WORDS[worst]}. Arcs to the left and right, "
            "forward and backward, with small and large steering angles, hold all of them; groma plan vehicle finds "
            "the least of them for your floor and tolerances."
        )
    return section("What to drive next", text("p", note))


def _misfit(result: CalibratedVehicle) -> Html:
    asked = [[t.name, number(t.statistic, 1), str(t.dof), _p(t.p_value), t.words] for t in result.found.tests]
    against = misfits(result)
    note = (
        "Nothing the residuals show speaks against the model."
        if not against
        else "Against the model: " + "; ".join(against) + "."
    )
    parts = [text("p", note), table(["question ", "χ²", "dof", "p", "answer "], asked)]
    if held := result.found.held_out:
        told = (
            f"Motions predicted by parameters that were estimated without them ({held.folds} parts in turn) are off by "
            f"{length(held.position_median)} and {angle(held.heading_median)} in the median, "
            f"{length(held.position_rms)} rms of the best nine in ten."
        )
        parts.append(text("p", told))
    captions = [
        ("along_the_drive", "A trend is something that changed on the way: load, tyres, a clock."),
        ("by_turn", "A slope over the curvature is a wrong wheelbase or gain; a step between the sides an offset."),
        ("by_speed", "A slope over the speed is a delay; a step between forward and backward an asymmetry."),
    ]
    for name, caption in captions:
        parts.append(figure(getattr(pictures, name)(result), f"What is left of every motion. {caption}", _DIRECTIONS))
    return section("Does the model fit?", *parts)


def _drive(result: CalibratedVehicle) -> Html:
    caption = (
        "The laser's way by the calibrated wheels, and the ends of the measured motions put one after the other. "
        "Both start alike; how far they part is the sum of all that is left."
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
    note = "Near ±1, two parameters can hardly be told apart by this drive. The covariance is in vehicle.toml."
    return section("Correlation", text("p", note), table(head, body))


def _reading(result: CalibratedVehicle) -> Html:
    outliers = int((~(result.found.weights >= 0.3)).sum())
    told = (
        f"Motions come from the {result.data.source}. {count(outliers, 'motion').capitalize()} hardly counted, "
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

"""The report on a calibrated camera: what it is, how far to trust it, what would make it better."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from groma.cameras.calibration import DISHONEST, CameraCalibration, ViewFit, projection_sigmas
from groma.cameras.images import Sightings
from groma.io.kalibr_camchain import holds
from groma.io.toml import to_toml
from groma.report.camera import pictures
from groma.report.camera.figures import coverage
from groma.report.findings import findings_section
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.words import count, number, pixels

_FOOTER = "groma {}: the same images and settings give the same bytes."
_ROWS = 40


def camera_report(name: str, found: CameraCalibration, sightings: Sightings, outcome: Outcome) -> str:
    """Return the page."""
    run = outcome.record
    title = f"groma calibrate camera · {name}"
    header = Html(f"<header>\n{text('p', title, 'over')}\n{text('h1', outcome.headline)}\n{_facts(found)}\n</header>")
    body = [
        header,
        findings_section(outcome.findings),
        _parameters(found),
        _projection(found),
        _residuals(found),
        _trust(found),
        _views(found, sightings),
        _seen(found, sightings),
        _files(name, found, run),
        Html(f"<footer>{text('p', _FOOTER.format(run.get('groma', '')))}</footer>"),
    ]
    return page(title, body)


def verdict(found: CameraCalibration) -> str:
    """Return in a sentence how accurate the calibration is, in pixels, and whether that was checked."""
    worst = projection_sigmas(found.camera, found.covariance)[1]
    good = (
        f"Projection uncertainty (σ): {pixels(float(np.nanmedian(worst)))} in the median over the image, "
        f"{pixels(float(np.nanmax(worst)))} at most"
    )
    return f"{good}; {_belief(found)}."


def _belief(found: CameraCalibration) -> str:
    factor = found.honesty.factor
    if factor is None:
        return "there are too few images to check this by split halves"
    if factor > DISHONEST:
        return (
            f"split halves of the images disagree {number(factor, 1)} times more than the residuals predict, "
            "which is included"
        )
    return f"split halves of the images agree as predicted (factor {number(factor, 2)})"


def _facts(found: CameraCalibration) -> Html:
    fx, fy = found.camera.parameters[:2]
    taken = sum(view.taken for view in found.views)
    return facts(
        [
            ("focal length", f"{number((fx + fy) / 2, 1)}\N{NO-BREAK SPACE}px"),
            ("residual, rms", pixels(found.rms)),
            ("views used", str(taken)),
            ("corners used", str(int(sum(view.used.sum() for view in found.views if view.taken)))),
            ("of the image covered", f"{number(100 * coverage(found), 0)}\N{NO-BREAK SPACE}%"),
            ("panels turned by up to", f"{number(np.degrees(found.tilt_spread), 0)}°"),
        ]
    )


def _parameters(found: CameraCalibration) -> Html:
    columns = (found.camera.names, found.camera.parameters, found.sigmas, found.sigmas_claimed, found.honesty.z_rms)
    rows = [
        [name, f"{value:.6g}", f"{s:.2g}", f"{c:.2g}", number(z, 1) if np.isfinite(z) and found.honesty.splits else "–"]
        for name, value, s, c, z in zip(*columns, strict=True)
    ]
    head = ["parameter ", "value", "σ to use", "σ formal", "halves differ [σ]"]
    note = (
        f"Lens model {found.camera.lens}, images of {found.camera.width} x {found.camera.height}. Parameters are "
        "correlated: judge by the projection uncertainty below, not by single sigmas."
    )
    return section("The camera", table(head, rows), text("p", note, "note"))


def _projection(found: CameraCalibration) -> Html:
    caption = (
        "Standard deviation of the projection of a far point, in its worst direction, by the covariance to use; a "
        "rotation of the whole camera is removed, because its pose is estimated too. Grey dots: corners used. Where "
        "there are none, the lens model is extrapolated."
    )
    return section("Projection uncertainty", figure(pictures.projection_map(found), caption))


def _residuals(found: CameraCalibration) -> Html:
    over = (
        "Corners used with their residuals, enlarged. If neighbouring arrows agree, the lens model does not fit or a "
        "panel is bent; random arrows are noise."
    )
    spread = "The curve is a normal distribution of the same spread; tails beyond it are outliers."
    keys = [("final", "dot", "corner used"), ("rejected", "line", "residual, enlarged")]
    each = "Dashed: all views together. In a view far above it the image is blurred, or the panel was bent or moved."
    bars = [("final", "bar", "used"), ("muted", "bar", "held out")]
    return section(
        "Residuals",
        figure(pictures.coverage(found), over, keys),
        figure(pictures.residuals(found), spread),
        figure(pictures.views(found), each, bars),
    )


def _trust(found: CameraCalibration) -> Html:
    honesty, (names, share) = found.honesty, found.weak
    if honesty.factor is None:
        told = "At least six images with the target are needed to compare halves; the formal covariance is unchecked."
    else:
        told = (
            f"In {count(honesty.splits, 'split')} the images were halved at random and both halves calibrated: their "
            f"parameters differ {number(honesty.factor, 2)} times as much as predicted, their projections by "
            f"{pixels(honesty.projection_rms)} (rms over the image). The covariance to use is the formal one times "
            f"{number(max(1.0, honesty.factor) ** 2, 2)}."
        )
    named, percent = " with ".join(names), number(100 * share, 0)
    weak = f"Strongly correlated: {named} ({percent} % of the scatter of all parameters)."
    advice = _advice(found)
    return section(
        "Check of the covariance", text("p", told), text("p", weak), *([text("p", advice)] if advice else [])
    )


def _advice(found: CameraCalibration) -> str:
    """Return what would help most, or nothing."""
    hints = []
    if coverage(found) < 0.6:
        hints.append("move the target over the whole image, especially to its corners")
    if np.degrees(found.tilt_spread) < 40:
        hints.append("tilt it more: 20 to 45 degrees in different directions")
    if (found.honesty.factor or 1.0) > 2:
        hints.append(
            "try a lens model with more parameters (--lens plumb_bob, rational), and check that the panel is flat"
        )
    return f"To improve it: {'; '.join(hints)}." if hints else ""


def _views(found: CameraCalibration, sightings: Sightings) -> Html:
    shown = sorted(found.views, key=lambda view: -view.rms)[:_ROWS]
    head = ["image ", "panel ", "corners", "left out", "rms [px]", "range [m]", "tilt", "σ depth [mm]", "note "]
    rows = [_view(view, sightings) for view in shown]
    title = f"Views, worst first ({len(shown)} of {len(found.views)})"
    return section("The views", details(title, table(head, rows)))


def _view(view: ViewFit, sightings: Sightings) -> list[str]:
    notes = [] if view.decided else ["mirrored pose fits nearly as well"]
    notes += [] if view.taken else ["held out"]
    return [
        sightings.names[int(view.detection.stamp)],
        view.detection.panel,
        str(len(view.used)),
        str(int((~view.used).sum())),
        number(view.rms, 3),
        number(view.distance, 2),
        f"{number(np.degrees(view.tilt), 0)}°",
        number(1000 * view.sigma_depth, 1),
        ", ".join(notes),
    ]


def _seen(found: CameraCalibration, sightings: Sightings) -> Html:
    told = [f"{count(len(sightings.names), 'image')} read, {count(len(sightings.empty), 'image')} without the target."]
    if (rms := found.held_out_rms) is not None:
        told.append(f"Views that were held out fit to {pixels(rms)} (rms).")
    parts = [text("p", " ".join(told))]
    if sightings.empty:
        parts.append(details("Images without the target", text("p", ", ".join(sightings.empty))))
    return section("Detections", *parts)


def _files(name: str, found: CameraCalibration, run: Mapping[str, object]) -> Html:
    files = {
        "report.html": "this page",
        f"{name}.yaml": "intrinsics for ROS (camera_info_manager, image_proc)",
        f"{name}.json": "parameters with the covariance to use; with the yaml, a camera of groma cameras map",
        "metrics.json": "the metrics of this page and more, for scripts",
        "run.toml": "settings, versions and the hashes of the images",
    }
    if holds(found.camera):
        files["camchain.yaml"] = "intrinsics for Kalibr and similar tools"
    settings = details("Settings, versions, input", text("pre", to_toml(run)))
    return section("Files and settings", table(["file ", "what for "], files.items()), settings)

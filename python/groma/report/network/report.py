"""The report on a mapped camera network: whether to trust it, where not, and what every file is for."""

from __future__ import annotations

from groma.io.toml import to_toml
from groma.nouns.network import NetworkMap
from groma.report.findings import findings_section
from groma.report.network import pictures
from groma.report.network.figures import current, sigma_position, sigma_rotation
from groma.report.network.words import remedies, weak_directions
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.words import angle, length, number

FILES = {
    "report.html": "this page",
    "network.json": "poses, intrinsics and their joint covariance",
    "NAME.yaml": "intrinsics of each camera after the survey, as ROS keeps them (camera_info)",
    "camchain.yaml": "all cameras as a Kalibr camera chain",
    "network.urdf": "the cameras as fixed joints",
    "static_transforms.txt": "the same as lines for tf2_ros' static_transform_publisher",
    "stops.tum": "where the robot stood: stamp x y z qx qy qz qw",
    "metrics.json": "the metrics of this page and more, for scripts",
    "run.toml": "settings, versions and the input's hash",
}
_FOOTER = "groma {}: the same input and settings give the same bytes."


def network_report(network: NetworkMap, outcome: Outcome) -> str:
    """Return the page.

    Parameters
    ----------
    network
        The map.
    outcome
        Verdict, findings and what goes into run.toml.
    """
    run, name = outcome.record, outcome.source
    head = f"<header>\n{text('p', f'groma cameras map · {name}', 'over')}\n{text('h1', outcome.headline)}"
    body = [
        Html(head + _facts(network) + "\n</header>"),
        findings_section(outcome.findings),
        _in_space(network),
        _from_above(network),
        _cameras(network),
        _weak(network),
        _honesty(network),
        _reading(network),
        section(
            "Files and settings",
            table(["file ", "what for "], FILES.items()),
            details("Settings, versions, input", text("pre", to_toml(run))),
        ),
        Html(f"<footer>{text('p', _FOOTER.format(run.get('groma', '')))}</footer>"),
    ]
    return page(f"groma cameras map · {name}", body)


def _facts(network: NetworkMap) -> Html:
    mapped = current(network)
    return facts(
        [
            ("cameras", str(len(mapped))),
            ("stops", str(len(network.halt_stamps))),
            ("views in the map", str(len(network.views.used))),
            ("driven", length(network.path_length)),
            ("odometry alone, off at the end", length(network.odometry_error)),
            ("largest σ of a position", length(max(map(sigma_position, mapped)))),
            ("largest σ of a direction", angle(max(map(sigma_rotation, mapped)))),
            ("corners, χ²/dof", number(network.corner_chi_square, 2)),
        ]
    )


def _in_space(network: NetworkMap) -> Html:
    caption = (
        "Every camera with its field of view and the ellipsoid of three standard deviations of its position, relative "
        "to the robot's first stop; the drive on the floor."
    )
    keys = [("ink", "line", "camera"), ("weak", "line", "3 σ of its position"), ("final", "dot", "stops")]
    return section("The network", figure(pictures.in_space(network), caption, keys))


def _from_above(network: NetworkMap) -> Html:
    caption = (
        "From above. Ellipses across the path come from heading errors of the odometry, those along it from distance "
        "errors."
    )
    keys = [("odometry", "dash", "odometry alone"), ("final", "line", "stops in the map"), ("weak", "line", "3 σ")]
    return section("From above", figure(pictures.from_above(network), caption, keys))


def _cameras(network: NetworkMap) -> Html:
    head = ["camera ", "x", "y", "z", "σ position", "σ direction", "views", "χ²/dof", "σ focal"]
    rows = [
        [
            camera.name if camera.current else f"{camera.name} (before)",
            *(f"{number(float(v), 3)}" for v in camera.pose[:3]),
            length(sigma_position(camera)),
            angle(sigma_rotation(camera)),
            str(camera.views),
            number(camera.chi_square_per_dof, 2),
            f"{number(100 * float(camera.intrinsics_covariance[0, 0]) ** 0.5 / camera.camera.parameters[0], 3)} %",
        ]
        for camera in network.cameras
    ]
    note = "Positions in metres in the frame of the map: the robot's first stop, x forward, floor at z = 0."
    return section("The cameras", text("p", note), table(head, rows))


def _weak(network: NetworkMap) -> Html:
    lines = [text("p", line) for line in weak_directions(network)]
    return section("Weak directions", *lines, text("p", remedies(network)))


def _honesty(network: NetworkMap) -> Html:
    rows = [[kind, str(n), number(chi / n, 2) if n else "–"] for kind, (chi, n) in network.residuals.items()]
    note = (
        "Squared residuals of the measurements, divided by their variances. For corners, odometry and floor the mean "
        "is near 1 if the σ are consistent; well above 1 they are too small, and with them those of the map."
    )
    fit = "Per camera: far above the others means a wrong calibration, or a camera that moved."
    surprise = (
        "Views in the order of the filter: around 6 (line) if the covariances are consistent; above the dashed line "
        "(one in a thousand) a view is rejected."
    )
    keys = [("accepted", "dot", "taken"), ("rejected", "cross", "rejected")]
    return section(
        "Consistency of the covariances",
        text("p", note),
        table(["measurement ", "number", "mean χ²"], rows),
        figure(pictures.fits(network), fit),
        figure(pictures.surprises(network), surprise, keys),
    )


def _reading(network: NetworkMap) -> Html:
    verdicts = list(network.views.verdicts)
    rows = [[f"views: {kind}", str(verdicts.count(kind))] for kind in sorted(set(verdicts))]
    rows += [[kind, f"{value:g}"] for kind, value in network.counts.items()]
    return section("What was read and skipped", table(["what ", "number"], rows))

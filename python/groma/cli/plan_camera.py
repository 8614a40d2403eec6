"""`groma plan camera`: what a robot with panels should drive next before one camera."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from msgspec.structs import replace
from numpy.typing import NDArray

from groma.camera import Camera
from groma.camera_plan import (
    DEFAULTS,
    CameraPlan,
    Judged,
    Search,
    Stage,
    middle_of_view,
    mount,
    plan_camera,
    ranked,
)
from groma.detection import Detection
from groma.errors import EstimationError, UserError
from groma.floor import Mount, Pose, foot_and_mount, on_floor, spatial
from groma.io.atomic import write_text
from groma.io.camera_drive import write_camera_plan, write_camera_waypoints
from groma.io.camera_info import read_camera_info
from groma.io.network_file import read_network, without_k3
from groma.io.network_recording import read_covariance, read_detections
from groma.io.notes import Notes
from groma.io.results import point_latest, result_directory, run_record, shown_command
from groma.io.target_file import read_target
from groma.io.toml import to_toml
from groma.report.camera_plan_report import camera_plan_report, plan_verdict
from groma.target import Target

Array = NDArray[np.float64]
HEIGHT, DOWN = 2.0, 25.0
"""Of a camera whose place is not said [m, deg]."""


def camera(
    intrinsics: Path | None = None,
    /,
    *,
    target: Path | None = None,
    name: str | None = None,
    height: float | None = None,
    down: float | None = None,
    image: tuple[int, int] | None = None,
    focal: float | None = None,
    start: tuple[float, float, float] | None = None,
    depth: tuple[float, float] = DEFAULTS.search.depth,
    side: float = DEFAULTS.search.side,
    sigma: float = DEFAULTS.search.target,
    lambda_: Annotated[float, Parameter(name="--lambda")] = DEFAULTS.search.lambda_,
    seen: Path | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Plan the drive of a robot with panels before one camera that makes its calibration as good as wanted.

    groma plan camera --height 2.4 --down 30 --sigma 0.5

    groma plan camera results/latest/door.yaml --target panels.toml --height 2.4 --down 30

    groma plan camera building/network.json --name door --target panels.toml --sigma 0.5

    The floor has its origin at the foot of the camera, x where it looks, y to the left. Of a camera of a network,
    --start and the waypoints are in the frame of the map.

    Parameters
    ----------
    intrinsics
        NAME.yaml of a calibration; NAME.json beside it says how well they are known, else they are taken as nominal. Or
        the network.json of mapped cameras, which says where they are, too. Without it an ordinary camera is planned
        for, or --image and --focal.
    target
        The panels and where they are on the robot (.toml); three upright ones, 45 degrees apart, when left out.
    name
        Of the camera in a network.
    height
        Of the camera above the floor [m]; 2 when left out.
    down
        How far it looks down [deg]; 25 when left out.
    image
        Columns and rows of the image, of a camera whose intrinsics are not known.
    focal
        Its focal length, about [pixel].
    start
        Where the robot stands: x, y [m], heading [deg]; in the middle of the view, facing the camera, when left out.
    depth
        Nearest and farthest distance from the camera that the robot may have, along its view [m].
    side
        Farthest to either side [m].
    sigma
        Standard deviation of the worst pixel to reach [pixel].
    lambda_
        Metres that one square metre less of variance, by odometry, of the camera's place is worth [1/m].
    seen
        What the camera saw of the panels since: detections.jsonl of a survey.
    output
        Folder for the results; a new one in results/ when left out.
    """
    placed = _mapped(intrinsics, name, height, down) if intrinsics and intrinsics.suffix == ".json" else None
    asked = placed or _asked(
        intrinsics, image, focal, HEIGHT if height is None else height, DOWN if down is None else down
    )
    panels = DEFAULTS.target if target is None else read_target(target)
    stage = Stage(asked.mount, asked.camera, panels)
    search = replace(DEFAULTS.search, target=sigma, depth=depth, side=side, lambda_=lambda_)
    middle = middle_of_view(stage, search)
    pose = (middle, 0.0, math.pi) if start is None else on_floor(asked.foot, (*start[:2], math.radians(start[2])))
    detections = [] if seen is None else _seen(seen, asked.name, panels)
    directory = result_directory(output, datetime.now().astimezone())
    plan = plan_camera(stage, pose, search, covariance=asked.covariance, seen=detections)
    ranking = ranked(stage, middle, search.noise)
    given = {"mount": list(asked.mount), "start": list(pose), "target": panels.json(), "camera": asked.camera.json()}
    settings = {"plan_camera": {**_table(search), **given}}
    record = run_record(settings, intrinsics, shown_command(sys.argv[1:]))
    save(directory, stage, plan, ranking, search, record, asked.foot)
    if output is None:
        point_latest(directory)
    print(plan_verdict(plan, search))
    print(f"{directory / 'report.html'}")
    if not plan.met:
        raise EstimationError(
            f"{sigma:g} px are not reached: allow more floor (--depth, --side), other panels, or a larger --sigma"
        )


def save(
    directory: Path,
    stage: Stage,
    plan: CameraPlan,
    ranking: tuple[Judged, ...],
    search: Search,
    record: dict[str, object],
    foot: Pose,
) -> None:
    """Write all files of a plan, the report last; the foot of the camera is in the frame of the waypoints."""
    write_camera_waypoints(directory / "waypoints.csv", plan, foot)
    write_camera_plan(directory / "plan.json", stage.camera, plan, foot)
    figures = json.dumps(_figures(plan, ranking), indent=1, sort_keys=True) + "\n"
    write_text(directory / "metrics.json", figures)
    write_text(directory / "run.toml", to_toml(record))
    write_text(directory / "report.html", camera_plan_report(stage, plan, ranking, search, record))


@dataclass(frozen=True, slots=True)
class _Asked:
    """The camera that is planned for."""

    camera: Camera
    covariance: Array | None
    mount: Mount
    foot: Pose = (0.0, 0.0, 0.0)
    name: str | None = None


def _mapped(path: Path, name: str | None, height: float | None, down: float | None) -> _Asked:
    """Return a camera of a network.json."""
    if height is not None or down is not None:
        raise UserError(f"{path}: says where the camera is: leave out --height and --down")
    cameras = {camera.name: camera for camera in read_network(path)[0] if camera.current}
    if name is None and len(cameras) == 1:
        name = next(iter(cameras))
    if name is None or name not in cameras:
        raise UserError(f"{path}: give --name, one of {', '.join(cameras) or 'none'}")
    chosen = cameras[name]
    position, quaternion = chosen.pose[:3].tolist(), chosen.pose[3:].tolist()
    placed = foot_and_mount(spatial(position, quaternion))
    if placed is None:
        raise UserError(f"{path}: {name} is below the floor or looks straight down: no drive is planned for that")
    return _Asked(chosen.camera, chosen.intrinsics_covariance, placed[1], placed[0], name)


def _asked(
    intrinsics: Path | None, image: tuple[int, int] | None, focal: float | None, height: float, down: float
) -> _Asked:
    known, covariance = _camera(intrinsics, image, focal)
    name = None if intrinsics is None else intrinsics.stem
    return _Asked(known, covariance, mount(height, math.radians(down)), name=name)


def _camera(intrinsics: Path | None, image: tuple[int, int] | None, focal: float | None) -> tuple[Camera, Array | None]:
    if intrinsics is not None:
        if image is not None or focal is not None:
            raise UserError("give either intrinsics or --image and --focal")
        known, spread = without_k3(read_camera_info(intrinsics)[1]), intrinsics.with_suffix(".json")
        return known, read_covariance(spread, known) if spread.exists() else None
    if image is None and focal is None:
        return DEFAULTS.camera, None
    if image is None or focal is None:
        raise UserError("--image and --focal go together: --image 1280 720 --focal 900")
    (width, height), lens = image, DEFAULTS.camera.lens
    rest = (0.0,) * (len(DEFAULTS.camera.parameters) - 4)
    try:
        return Camera(width, height, lens, (focal, focal, (width - 1) / 2, (height - 1) / 2, *rest)), None
    except (ValueError, OverflowError) as error:
        raise UserError(f"--image, --focal: {error}") from error


def _seen(path: Path, name: str | None, target: Target) -> list[Detection]:
    """Return what the camera saw of the target; of all cameras there must be only one when it has no name."""
    notes = Notes()
    found = [detection for detection, _ in read_detections(path, notes)]
    for line in notes.lines():
        print(f"note: {line}", file=sys.stderr)
    names = sorted({detection.camera for detection in found})
    if name is None and len(names) > 1:
        raise UserError(f"{path}: is of {len(names)} cameras: give the intrinsics of one, {names[0]}.yaml")
    own = [detection for detection in found if name in (None, detection.camera)]
    if not own:
        raise UserError(f"{path}: nothing that {name or 'a camera'} saw; there are {', '.join(names) or 'none'}")
    corners = {panel.name: len(panel.corners) for panel in target.panels}
    for detection in own:
        if detection.panel not in corners:
            raise UserError(f"{path}: panel {detection.panel!r} is none of the target: {', '.join(corners)}")
        if detection.corners.max(initial=0) >= corners[detection.panel]:
            raise UserError(f"{path}: panel {detection.panel!r} has {corners[detection.panel]} corners, not as many")
    return own


def _table(search: Search) -> dict[str, object]:
    noise = {name: getattr(search.noise, name) for name in ("along", "across", "heading", "turn")}
    return {
        "sigma": search.target,
        "depth": list(search.depth),
        "side": search.side,
        "lambda": search.lambda_,
        "drives": search.drives,
        "noise": noise,
    }


def _figures(plan: CameraPlan, ranking: tuple[Judged, ...]) -> dict[str, object]:
    end = plan.end
    return {
        "met": plan.met,
        "worst_pixel_before": _stable(plan.worst_before),
        "worst_pixel_after": _stable(end.worst),
        "distance_m": _stable(end.length),
        "effort_m": _stable(end.effort),
        "odometry_sigma_m": _stable(math.sqrt(end.variance)),
        "looks": plan.looks,
        "panels_seen": sum(stop.views for stop in plan.stops),
        "panels_seen_before": plan.seen,
        "motions": {
            judged.motion: {
                "worst_pixel": _stable(judged.worst),
                "distance_m": _stable(judged.length),
                "effort_m": _stable(judged.effort),
                "degenerate": judged.degenerate,
            }
            for judged in ranking
        },
    }


def _stable(value: float) -> float:
    return float(f"{value:.9g}")

"""`groma plan camera`: what a robot with panels should drive next before one camera."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.io.notes import Notes
from groma.io.target_file import read_target
from groma.planning.camera import DEFAULTS, Stage, middle_of_view
from groma.planning.floor import on_floor
from groma.planning.planned_camera import described, mapped, read_seen
from groma.runs.camera_plan import plan_camera_into
from groma.runs.run import Run
from groma.runs.tables import search_of, settings_of

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
    depth: tuple[float, float] | None = None,
    side: float | None = None,
    sigma: float | None = None,
    lambda_: Annotated[float | None, Parameter(name="--lambda")] = None,
    seen: Path | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
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
        Metres of driving traded for one square metre less of the camera's position variance by odometry [1/m].
    seen
        What the camera saw of the panels since: detections.jsonl of a survey.
    output
        Folder for the results; a new one in results/ when left out.
    config
        TOML with a table [plan_camera] (groma config prints it) or the run.toml of another run.
    """
    given = {"depth": list(depth) if depth else None, "side": side, "sigma": sigma, "lambda": lambda_}
    search = search_of(settings_of("plan_camera", config, **given))
    placed = mapped(intrinsics, name, height, down) if intrinsics and intrinsics.suffix == ".json" else None
    asked = placed or described(
        intrinsics, image, focal, HEIGHT if height is None else height, DOWN if down is None else down
    )
    panels = DEFAULTS.target if target is None else read_target(target)
    stage = Stage(asked.mount, asked.camera, panels)
    middle = (middle_of_view(stage, search), 0.0, math.pi)
    pose = middle if start is None else on_floor(asked.foot, (*start[:2], math.radians(start[2])))
    with Run("plan", "plan camera", output) as run:
        run.inputs |= {"input": intrinsics, "seen": seen}
        notes = Notes()
        run.gather(notes.findings)
        detections = [] if seen is None else read_seen(seen, asked.name, panels, notes)
        plan_camera_into(run, asked, stage, pose, search, detections)

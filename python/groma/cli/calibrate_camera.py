"""`groma calibrate camera`: images of a target in, intrinsics with their uncertainty out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.target_file import read_target
from groma.runs.camera import calibrate_camera_into
from groma.runs.run import Run
from groma.runs.tables import settings_of

Lens = Literal["pinhole", "radtan", "plumb_bob", "rational", "equidistant"]


def camera(
    images: Path,
    /,
    *,
    target: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    lens: Lens | None = None,
    name: str = "camera",
    config: Path | None = None,
) -> None:
    """Calibrate a camera from images of a target: intrinsics, their covariance, and a report.

    groma calibrate camera images --target april_6x6.yaml

    groma calibrate camera drive.mp4 --target panels.toml --lens equidistant --name door -o door

    Parameters
    ----------
    images
        Folder with images, or a video.
    target
        What is in them: a target of Kalibr (.yaml), or panels of groma (.toml).
    output
        Folder for the results; a new one in results/ when left out.
    lens
        Lens model. radtan (k1 k2 p1 p2) suits most lenses; plumb_bob and rational have more coefficients, equidistant
        is for fisheyes.
    name
        Name of the camera and of its files.
    config
        TOML with a table [camera] (groma config prints it) or the run.toml of another run.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name):
        raise UserError(f"--name {name!r}: letters, digits, _ . and - only, for files are named by it")
    settings = settings_of("camera", config, lens=lens)
    panels = read_target(target)
    with Run("camera", "calibrate camera", output) as run:
        calibrate_camera_into(run, images, panels, settings, name)

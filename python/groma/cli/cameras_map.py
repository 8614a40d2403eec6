"""`groma cameras map`: the recording of a survey in, the map of the building's cameras out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.cameras.survey import open_network
from groma.runs.network import map_network_into
from groma.runs.run import Run
from groma.runs.tables import settings_of


def map_(
    recording: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
) -> None:
    """Map a building's cameras from a survey: their poses with joint covariance, their intrinsics, a report.

    groma cameras map survey

    Parameters
    ----------
    recording
        Folder with target, odometry, intrinsics, and detections or images (docs/reference/camera_network.md).
    output
        Folder for the results; a new one in results/ when left out.
    config
        TOML with a table [cameras] (groma config prints it) or the run.toml of another run.
    """
    settings = settings_of("cameras", config)
    with Run("network", "cameras map", output) as run:
        map_network_into(run, open_network(recording), settings)

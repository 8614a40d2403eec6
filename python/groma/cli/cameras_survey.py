"""`groma cameras survey`: the robot's side of the camera network, and the map at its end."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.cameras.survey import open_network, open_setup
from groma.io.recording import open_recording
from groma.link.collecting import collect, recording_folder
from groma.link.leading import leaders, tell
from groma.link.options import Link
from groma.runs.network import map_network_into
from groma.runs.place import check_place
from groma.runs.record import shown_command
from groma.runs.run import Run
from groma.runs.tables import settings_of


def survey(
    setup: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    recording: Path | None = None,
    drive: Path | None = None,
    building: Path | None = None,
    sigma: float | None = None,
    config: Path | None = None,
    link: Annotated[Link, Parameter(name="*")] = Link(),  # noqa: B008
) -> None:
    """Survey a building's cameras live: announce stops, collect what the cameras saw, record, and map at Ctrl-C.

    groma cameras survey setup -o building

    groma cameras survey setup -o building --sigma 1

    Parameters
    ----------
    setup
        Folder with the target on the robot and the intrinsics of the cameras: a survey without its recording
        (docs/reference/camera_network.md).
    output
        Folder for the map; a new one in results/ when left out.
    recording
        Folder for what is received, a survey for groma cameras map; a new one in recordings/ when left out. It is never
        replaced.
    drive
        A recording whose odometry is played as the robot's, in its own time; the survey ends when it ends. Without it
        the robot publishes its odometry (docs/reference/camera_protocol.md).
    building
        The building, a yaml file whose places bear the names of the cameras (docs/reference/camera_graph.md): tell at
        each camera which one to drive to next.
    sigma
        Also tell at every stop what to drive next before a camera, until its worst pixel has this standard deviation
        [pixel].
    config
        TOML with a table [cameras] (groma config prints it) or the run.toml of another run.
    link
        Where to meet.
    """
    settings = settings_of("cameras", config)
    leading = leaders(open_setup(setup), building, sigma)
    played = None if drive is None else open_recording(drive)
    check_place(output)
    folder = recording_folder(recording)
    tell(f"recording into {folder}")
    lost = collect(setup, folder, link, leading, played)
    with Run("network", "cameras survey", output, command=shown_command(["cameras", "map", folder.name])) as run:
        run.extend(lost)
        map_network_into(run, open_network(folder), settings)

"""`groma cameras node`: one camera on the network."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.camera_protocol import checked_name
from groma.io.target_file import read_target
from groma.link.journal import Journal
from groma.link.node import ROBOT, Node, new_boot
from groma.link.options import Link, end_on_signal
from groma.link.session import connect
from groma.link.sight import sight
from groma.link.sources import open_source
from groma.runs.tables import settings_of


def node(
    source: Path,
    /,
    *,
    camera: str,
    target: Path,
    rate: float | None = None,
    journal: Path = Path("journal"),
    config: Path | None = None,
    link: Annotated[Link, Parameter(name="*")] = Link(),  # noqa: B008
) -> None:
    """Put a camera on the network: take images at the robot's stops, detect, publish what was seen, until Ctrl-C.

    groma cameras node images --camera hall --target target.toml

    Parameters
    ----------
    source
        A folder of images (each is taken once, in the order of their names), a video file, or a device like
        /dev/video0.
    camera
        Name of the camera.
    target
        The panels on the robot: a .toml of groma's, a .yaml of Kalibr's.
    rate
        Images each second beside those at stops; they are recorded, not mapped. None when left out.
    journal
        Folder in which what was published is kept, so that it can be sent again; the camera has a folder in it.
    config
        TOML with a table [node] (groma config prints it).
    link
        Where to meet.
    """
    if checked_name(camera, "--camera") == ROBOT:
        raise UserError(f"--camera {camera}: this name is the survey's: choose another")
    each_second = float(str(settings_of("node", config, rate=rate)["rate"]))
    if not 0.0 <= each_second <= 1000.0:
        raise UserError(f"--rate {each_second}: must be between 0 and 1000")
    detect = sight(read_target(target))
    images = open_source(source)
    boot = new_boot()
    kept = Journal(journal / camera, boot)
    try:
        with end_on_signal() as end, connect(link.endpoint, link.keys) as session:
            print(f"{camera}: {images.name}, waiting for a survey at {link.endpoint}; Ctrl-C ends", file=sys.stderr)
            Node(session, link.site, camera, images, detect, kept, boot, each_second, report=_tell).run(end)
    finally:
        kept.close()


def _tell(line: str) -> None:
    print(line, file=sys.stderr)

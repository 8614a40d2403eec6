"""`groma cameras survey`: the robot's side of the camera network, and the map at its end."""

from __future__ import annotations

import queue
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.live import Live
from rich.table import Table

from groma.cli.cameras_map import map_and_tell
from groma.cli.link_options import Link, end_on_signal
from groma.errors import UserError
from groma.io.camera_graph import read_graph
from groma.io.link_recording import Recorder
from groma.io.network_recording import LIVE, NetworkRecording, open_network, open_setup
from groma.io.recording import Recording, open_recording
from groma.io.results import point_latest, result_directory, shown_command
from groma.link.guide import Advice, Guide, aim
from groma.link.itinerary import Itinerary
from groma.link.node import new_boot
from groma.link.protocol import Numbered
from groma.link.robot import Robot
from groma.link.session import connect, listen
from groma.link.survey import Peer, Survey
from groma.models import Odometry
from groma.network import network_defaults
from groma.report.camera_plan_report import instruction
from groma.report.words import pixels

Leader = Callable[[Numbered], str | None]
"""Takes each new message; returns a line for the driver now and then."""

_PERIOD = 0.5
"""Time between two looks at who is alive [s]."""


def survey(
    setup: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    drive: Path | None = None,
    building: Path | None = None,
    sigma: float | None = None,
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
        Folder for the survey and the map; a new one in results/ when left out.
    drive
        A recording whose odometry is played as the robot's, in its own time; the survey ends when it ends. Without it
        the robot publishes its odometry (docs/reference/camera_protocol.md).
    building
        The building, a yaml file whose places bear the names of the cameras (docs/reference/camera_graph.md): tell at
        each camera which one to drive to next.
    sigma
        Also tell at every stop what to drive next before a camera, until its worst pixel has this standard deviation
        [pixel].
    link
        Where to meet.
    """
    known = open_setup(setup)
    leaders = _leaders(known, building, sigma)
    played = None if drive is None else open_recording(drive)
    directory = result_directory(output, datetime.now().astimezone())
    recorded = directory / "survey"
    _copy_setup(setup, recorded)
    end = end_on_signal()
    with _recorder(recorded / LIVE) as recorder, listen(link.endpoint, link.keys) as session:
        fresh: queue.SimpleQueue[Numbered] = queue.SimpleQueue()
        collecting = Survey(session, link.site, new_boot(), recorder, fresh.put, report=_tell)
        if played is not None:
            threading.Thread(target=_play, args=(played, link, end), daemon=True).start()
        thread = threading.Thread(target=_watch, args=(collecting, end), daemon=True)
        thread.start()
        threading.Thread(target=_lead, args=(leaders, fresh, end), daemon=True).start()
        collecting.run(end)
        thread.join()
        _account(collecting.peers())
    if output is None:
        point_latest(directory)
    command = shown_command(["cameras", "map", recorded.name])
    map_and_tell(directory, open_network(recorded), network_defaults(), command)


def _leaders(known: NetworkRecording, building: Path | None, sigma: float | None) -> list[Leader]:
    """Return what listens to the messages and now and then has a line for the driver."""
    leaders: list[Leader] = []
    itinerary = None if building is None else _itinerary(building, [camera.name for camera in known.cameras])
    if itinerary is not None:
        leaders.append(lambda message: str(leg) if (leg := itinerary.take(message)) else None)
    if sigma is not None:
        guide = Guide(known.target, known.cameras, aim(sigma))
        leaders.append(lambda message: _and_then(advice, itinerary) if (advice := guide.take(message)) else None)
    return leaders


def _and_then(advice: Advice, itinerary: Itinerary | None) -> str:
    """Return advice as a line; where a camera is known as well as wanted, also where to go on to."""
    leg = itinerary.leg if itinerary and advice.met else None
    return f"{told(advice)}\n{leg}" if leg and leg.start == advice.camera else told(advice)


def _itinerary(building: Path, cameras: Sequence[str]) -> Itinerary:
    graph = read_graph(building)
    try:
        return Itinerary(graph, cameras)
    except UserError as error:
        raise UserError(f"{building}: {error}") from error


def _lead(leaders: Sequence[Leader], fresh: queue.SimpleQueue[Numbered], end: threading.Event) -> None:
    """Tell what to drive next, beside the loop that collects, until the survey ends."""
    while not end.is_set():
        try:
            message = fresh.get(timeout=_PERIOD)
        except queue.Empty:
            continue
        for line in filter(None, (leader(message) for leader in leaders)):
            _tell(line)


def told(advice: Advice) -> str:
    """Return advice as a line for the driver."""
    known = f"{advice.camera}: the worst pixel is known to {pixels(advice.worst)}"
    if advice.met:
        return f"{known}, as wanted: go on"
    if not advice.looks:
        return f"{known}, and no drive around here makes it better"
    way, stops = instruction(advice.start, advice.looks), sum(look.views > 0 for look in advice.looks)
    return f"{known}; next: {way}, stopping {stops} times on the way ({pixels(advice.expected)} then)"


def _copy_setup(setup: Path, recorded: Path) -> None:
    """Copy what the map needs beside the recording, so that the folder is a survey of its own."""
    (recorded / "cameras").mkdir(parents=True, exist_ok=True)
    for path in (*setup.glob("target.*"), *setup.glob("cameras/*.yaml"), *setup.glob("cameras/*.json")):
        shutil.copyfile(path, recorded / path.relative_to(setup))


@contextmanager
def _recorder(path: Path) -> Iterator[Recorder]:
    recorder = Recorder(path)
    try:
        yield recorder
    finally:
        recorder.close()


def _play(drive: Recording, link: Link, end: threading.Event) -> None:
    """Send the odometry of a recording in its own time, then end the survey."""
    with connect(link.endpoint, link.keys) as session:
        robot, began, first = Robot(session, link.site), time.monotonic(), None
        for message in drive.messages():
            if not isinstance(message, Odometry):
                continue
            first = message.stamp if first is None else first
            if end.wait(max(0.0, began + message.stamp - first - time.monotonic())):
                return
            robot.send(message.stamp, message.x, message.y, message.theta)
    end.set()


def _watch(collecting: Survey, end: threading.Event) -> None:
    """Show who is alive until the survey ends: a table on a terminal, else a line when one comes or goes."""
    console = Console(stderr=True)
    if console.is_terminal:
        with Live(console=console, transient=True, auto_refresh=False) as live:
            while not end.wait(_PERIOD):
                live.update(_table(collecting), refresh=True)
        return
    alive: set[str] = set()
    while not end.wait(_PERIOD):
        now = {name for name, peer in collecting.peers().items() if peer.alive}
        for name in sorted(now ^ alive):
            _tell(f"{name} is {'there' if name in now else 'gone'}")
        alive = now


def _table(collecting: Survey) -> Table:
    where = "moving" if collecting.stop is None else f"standing at stop {collecting.stop}"
    table = Table("sender", "", "messages", "missing", "twice", "trouble", title=f"robot {where}")
    for name, peer in collecting.peers().items():
        trouble = peer.health.trouble if peer.health else ""
        counts = (str(n) for n in (peer.tally.taken, peer.tally.missing, peer.tally.repeated))
        table.add_row(name, "alive" if peer.alive else "", *counts, trouble)
    return table


def _account(peers: dict[str, Peer]) -> None:
    """Say what arrived, and what did not."""
    for name, peer in peers.items():
        lost = f", {peer.tally.missing} lost for good" if peer.tally.missing else ""
        _tell(f"{name}: {peer.tally.taken} messages{lost}")


def _tell(line: str) -> None:
    print(line, file=sys.stderr)

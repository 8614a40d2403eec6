"""Collect a live survey into a recording: odometry played or received, what the cameras send, who is there."""

from __future__ import annotations

import queue
import shutil
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from rich.console import Console
from rich.live import Live
from rich.table import Table

from groma.cameras.survey import LIVE
from groma.errors import UserError
from groma.io.camera_protocol import Numbered
from groma.io.link_recording import Recorder
from groma.io.recording import Recording
from groma.link.leading import Leader, lead, tell
from groma.link.node import new_boot
from groma.link.options import Link, end_on_signal
from groma.link.robot import Robot
from groma.link.session import connect, listen
from groma.link.survey import Peer, Survey
from groma.nouns.findings import Finding
from groma.nouns.messages import Odometry

ROOT = Path("recordings")
_PERIOD = 0.5
"""Time between two looks at who is alive [s]."""


def collect(
    setup: Path, folder: Path, link: Link, leaders: Sequence[Leader], played: Recording | None
) -> list[Finding]:
    """Collect a survey until Ctrl-C or the end of the drive that is played, and return what did not arrive.

    Parameters
    ----------
    setup
        The survey without its recording: copied, so that the folder is a survey of its own.
    folder
        The recording; made by :func:`recording_folder`.
    link
        Where to meet.
    leaders
        Tell the driver what to do next.
    played
        A recording whose odometry is played as the robot's; None where the robot sends its own.
    """
    _copy_setup(setup, folder)
    with end_on_signal() as end, _recorder(folder / LIVE) as recorder, listen(link.endpoint, link.keys) as session:
        fresh: queue.SimpleQueue[Numbered] = queue.SimpleQueue()
        collecting = Survey(session, link.site, new_boot(), recorder, fresh.put, report=tell)
        if played is not None:
            threading.Thread(target=_play, args=(played, link, end), daemon=True).start()
        thread = threading.Thread(target=_watch, args=(collecting, end), daemon=True)
        thread.start()
        threading.Thread(target=lead, args=(leaders, fresh, end), daemon=True).start()
        collecting.run(end)
        thread.join()
        return _account(collecting.peers())


def recording_folder(wanted: Path | None) -> Path:
    """Make the folder of a recording: one that is new, for a recording is never replaced.

    Parameters
    ----------
    wanted
        What the user requested; None: a new one in `recordings`, named by the time.

    Raises
    ------
    UserError
        When there is something in it, or it cannot be made.
    """
    stamp = datetime.now().astimezone().strftime("%Y-%m-%dT%H-%M-%S")
    folder = ROOT / stamp if wanted is None else wanted
    number = 2
    while wanted is None and folder.exists():
        folder, number = ROOT / f"{stamp}-{number}", number + 1
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise UserError(f"{folder}: is not empty, and a recording is never replaced: choose another --recording")
    except OSError as error:
        raise UserError(f"{folder}: cannot be made ({error.strerror}): choose another --recording") from error
    return folder


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
            tell(f"{name} is {'there' if name in now else 'gone'}")
        alive = now


def _table(collecting: Survey) -> Table:
    where = "moving" if collecting.stop is None else f"standing at stop {collecting.stop}"
    table = Table("sender", "", "messages", "missing", "twice", "trouble", title=f"robot {where}")
    for name, peer in collecting.peers().items():
        trouble = peer.health.trouble if peer.health else ""
        counts = (str(n) for n in (peer.tally.taken, peer.tally.missing, peer.tally.repeated))
        table.add_row(name, "alive" if peer.alive else "", *counts, trouble)
    return table


def _account(peers: Mapping[str, Peer]) -> list[Finding]:
    """Say what arrived, and return what did not."""
    lost = []
    for name, peer in peers.items():
        tell(f"{name}: {peer.tally.taken} messages")
        if missing := peer.tally.missing:
            text = f"{name}: {missing} messages never arrived"
            lost.append(Finding("messages-lost", text, values={"count": (missing, "1")}))
    return lost

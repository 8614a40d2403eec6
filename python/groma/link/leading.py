"""What the driver of a survey is told: which camera to drive to next, what to drive before it."""

from __future__ import annotations

import queue
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from groma.cameras.survey import NetworkRecording
from groma.errors import UserError
from groma.io.camera_graph import read_graph
from groma.io.camera_protocol import Numbered
from groma.link.guide import Advice, Guide, aim
from groma.link.itinerary import Itinerary
from groma.report.camera_plan.report import instruction
from groma.report.words import pixels

Leader = Callable[[Numbered], str | None]
"""Takes each new message; returns a line for the driver now and then."""

_PERIOD = 0.5
"""Time between two looks at whether the survey has ended [s]."""


def leaders(known: NetworkRecording, building: Path | None, sigma: float | None) -> list[Leader]:
    """Return what listens to the messages and now and then has a line for the driver."""
    found: list[Leader] = []
    itinerary = None if building is None else _itinerary(building, [camera.name for camera in known.cameras])
    if itinerary is not None:
        found.append(lambda message: str(leg) if (leg := itinerary.take(message)) else None)
    if sigma is not None:
        guide = Guide(known.target, known.cameras, aim(sigma))
        found.append(lambda message: _and_then(advice, itinerary) if (advice := guide.take(message)) else None)
    return found


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


def lead(leaders: Sequence[Leader], fresh: queue.SimpleQueue[Numbered], end: threading.Event) -> None:
    """Tell what to drive next, beside the loop that collects, until the survey ends."""
    while not end.is_set():
        try:
            message = fresh.get(timeout=_PERIOD)
        except queue.Empty:
            continue
        for line in filter(None, (leader(message) for leader in leaders)):
            tell(line)


def told(advice: Advice) -> str:
    """Return advice as a line for the driver."""
    known = f"{advice.camera}: worst-pixel error {pixels(advice.worst)}"
    if advice.met:
        return f"{known}: accurate enough"
    if not advice.looks:
        return f"{known}: no drive around here improves it"
    way, stops = instruction(advice.start, advice.looks), sum(look.views > 0 for look in advice.looks)
    return f"{known}; next: {way}, with {stops} stops ({pixels(advice.expected)} then)"


def tell(line: str) -> None:
    """Tell the driver."""
    sys.stderr.write(f"{line}\n")

"""From what a survey recorded to what a map is made of, in an order that does not depend on arrival.

Detections count when they were taken at a stop of this survey; they get the time at which the robot stood there, by the
robot's clock. The clocks of the cameras are not used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np

from groma.io.camera_protocol import Corners, Detections, Numbered, Odometry, Stop, in_order
from groma.io.link_recording import read_messages
from groma.nouns import messages as models
from groma.nouns.detection import Detection

Timed = tuple[models.Odometry | Detection, int | None]


def network_messages(path: Path, skip: Callable[[str], None]) -> Iterator[Timed]:
    """Yield the odometry and the detections of a recording, the latter with the number of their stop.

    Parameters
    ----------
    path
        `recording.mcap` of a survey.
    skip
        Takes the reason for each message that is left out.

    Raises
    ------
    UserError
        When a message in it is not one of the protocol.
    """
    yield from messages_to_map((m for m in read_messages(path) if isinstance(m, Numbered)), skip)


def messages_to_map(messages: Iterable[Numbered], skip: Callable[[str], None]) -> Iterator[Timed]:
    """Yield the same from messages in any order, some of them twice."""
    numbered = in_order(list(messages))
    stops = {(m.boot, m.stop): m.stamp for m in numbered if isinstance(m, Stop) and m.standing}
    numbers = {stop: number for number, stop in enumerate(sorted(stops, key=lambda stop: stops[stop]))}
    for message in numbered:
        if isinstance(message, Odometry):
            yield models.Odometry(message.stamp, message.sender, message.x, message.y, message.theta), None
    for message in numbered:
        if isinstance(message, Detections):
            place = (message.survey or "", message.stop)
            if place not in stops:
                skip("images taken while no stop lasted" if message.survey is None else "images of an unknown stop")
                continue
            for corners in message.panels:
                yield to_detection(message.sender, stops[place], corners), numbers[place]


def to_detection(camera: str, stamp: float, corners: Corners) -> Detection:
    """Return what a camera saw of a panel."""
    pixels = np.column_stack([corners.u, corners.v]).astype(np.float64).reshape(-1, 2)
    return Detection(
        stamp, camera, corners.panel, np.array(corners.ids, dtype=np.int64), pixels, np.array(corners.sigma)
    )

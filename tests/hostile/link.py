"""Recordings of a live survey with one number of one message replaced."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec

from groma.cameras.survey import read_detections
from groma.io.camera_protocol import AnyMessage, Corners, Detections, Health, Odometry, Stop
from groma.io.link_recording import Recorder
from groma.io.notes import Notes
from groma.io.recording import open_recording
from groma.nouns import messages as models
from hostile.changes import Change, changes

BOOT = "b1"


def messages(survey: Path) -> list[AnyMessage]:
    """The odometry and the detections of a survey's folder as a robot and nodes would have sent them."""
    rows = [m for m in open_recording(survey / "odometry.csv").messages() if isinstance(m, models.Odometry)]
    out: list[AnyMessage] = [
        Odometry(sender="robot", boot=BOOT, sequence=k, stamp=m.stamp, x=m.x, y=m.y, theta=m.theta)
        for k, m in enumerate(rows)
    ]
    seen = [(d, stop) for d, stop in read_detections(survey / "detections.jsonl", Notes()) if stop is not None]
    when = {stop: d.stamp for d, stop in seen}
    counts = {"robot": len(rows)}
    for stop, stamp in when.items():
        told = Stop(sender="robot", boot=BOOT, sequence=counts["robot"], stop=stop, stamp=stamp, standing=True, burst=1)
        counts["robot"] += 1
        out.append(told)
    for d, stop in seen:
        u, v = map(tuple, d.pixels.reshape(-1, 2).T.tolist())
        corners = Corners(panel=d.panel, ids=tuple(d.corners.tolist()), u=u, v=v, sigma=tuple(d.sigma.tolist()))
        count = counts.setdefault(d.camera, 0)
        told_by = {"sender": d.camera, "boot": BOOT, "sequence": count, "frame": count, "survey": BOOT, "stop": stop}
        size = {"captured": d.stamp, "clock_sigma": 0.01, "width": 640, "height": 480}
        out.append(Detections(**told_by, **size, panels=(corners,)))  # type: ignore[arg-type]
        counts[d.camera] += 1
    sent = {BOOT: counts["robot"]}
    out.append(Health(sender="robot", boot=BOOT, counts=sent, source="made", width=640, height=480, frames=0))
    return out


def middles(told: list[AnyMessage]) -> list[int]:
    """The middle message of each kind."""
    kinds: dict[type, list[int]] = {}
    for k, message in enumerate(told):
        kinds.setdefault(type(message), []).append(k)
    return [places[len(places) // 2] for places in kinds.values()]


def cases(told: list[AnyMessage]) -> Iterator[tuple[int, Change]]:
    """Yield every change of the middle messages: the number of the message, and what becomes of its JSON."""
    for k in middles(told):
        for change in changes(msgspec.json.encode(told[k]).decode(), "json", [1]):
            yield k, change


def write(path: Path, told: list[AnyMessage], changed: int = -1, text: str = "") -> None:
    """Write the recording, one message of it changed."""
    recorder = Recorder(path)
    for k, message in enumerate(told):
        data = text.encode() if k == changed else msgspec.json.encode(message)
        recorder.write(f"site/{type(message).__name__.lower()}", message, data, float(k))
    recorder.close()

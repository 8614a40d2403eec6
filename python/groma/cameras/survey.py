"""A survey of a camera network as a folder.

Its files:

    target.toml            the panels on the robot: groma's file (or target.yaml, Kalibr's, for one panel)
    odometry.*             any recording with odometry that groma reads (CSV, bag, MCAP, CARMEN)
    cameras/NAME.yaml      intrinsics of each camera, as ROS keeps them (camera_info)
    cameras/NAME.json      the covariance of its parameters, when it is known
    detections.jsonl       what the cameras saw: one panel in one image a line
    images/NAME/STAMP.png  without detections.jsonl: the images, named by the time of the exposure [s]
    recording.mcap         in place of odometry and detections: what a live survey received (io/link_recording.py)

A line of detections.jsonl (gzip it if you like, detections.jsonl.gz):

    {"stamp":100.5,"camera":"camera1","panel":"ahead","stop":0,"ids":[0,1],"u":[10.2,30.1],"v":[5.0,5.1],"sigma":0.3}

`stop` (number of the robot's stop) may be left out; `sigma` is one number or one a corner. Malformed lines are told and
left out. The clocks of cameras and robot must agree to the length of a stop, or `stop` be given.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from groma.cameras.detection_cache import DetectionCache
from groma.cameras.images import find_targets
from groma.cameras.survey_messages import network_messages
from groma.cameras.vision import detection_defaults
from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.camera_info import read_camera_info, write_camera_info
from groma.io.images import read_images
from groma.io.notes import Notes
from groma.io.panels import write_panels
from groma.io.recording import open_recording, write_recording
from groma.io.table import read_bytes
from groma.io.target_file import read_target
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.messages import Odometry
from groma.nouns.network import KnownCamera
from groma.nouns.target import Target

Count = Annotated[int, Meta(ge=0, le=2**53)]
Positive = Annotated[float, Meta(gt=0)]
LIVE = "recording.mcap"
"""What a live survey received."""


class _Line(msgspec.Struct, frozen=True):
    stamp: float
    camera: str
    panel: str
    ids: tuple[Count, ...]
    u: tuple[float, ...]
    v: tuple[float, ...]
    sigma: Positive | tuple[Positive, ...]
    stop: Count | None = None


class _Covariance(msgspec.Struct):
    version: int
    parameters: tuple[str, ...]
    covariance: list[list[float]]


@dataclass(slots=True)
class NetworkRecording:
    """A survey that was recorded; messages may be read any number of times."""

    path: Path
    target: Target
    cameras: tuple[KnownCamera, ...]
    notes: Notes = field(default_factory=Notes)
    """What the last pass left out."""
    cache: Path | None = None
    """Folder in which detections in images were kept by an earlier run."""
    keep: Path | None = None
    """Folder in which they are kept for the next run."""

    def messages(self) -> Iterator[tuple[Odometry | Detection, int | None]]:
        """Yield odometry and detections, the latter with the number of their stop when it is known."""
        self.notes.restart()
        live = self.path / LIVE
        yield from network_messages(live, self.notes.skip) if live.exists() else self._files()

    def _files(self) -> Iterator[tuple[Odometry | Detection, int | None]]:
        odometry = open_recording(_only(self.path, "odometry.*"))
        for message in odometry.messages():
            if isinstance(message, Odometry):
                yield message, None
        for finding in odometry.notes.findings():
            self.notes.take(replace(finding, text=f"odometry: {finding.text}"))
        if list(self.path.glob("detections.jsonl*")):
            yield from read_detections(_only(self.path, "detections.jsonl*"), self.notes)
        else:
            yield from self._sightings()

    def _sightings(self) -> Iterator[tuple[Detection, None]]:
        """Look for the target in the images of each camera."""
        gates = detection_defaults()
        cache = DetectionCache(self.cache or self.path, self.target, gates)
        for known in self.cameras:
            folder = self.path / "images" / known.name
            if not folder.is_dir():
                self.notes.assume(f"{known.name}: no folder {folder}, so it saw nothing")
                continue
            found = find_targets(read_images(folder, self.notes), self.target, gates, cache, camera=known.name)
            if found.size != (known.camera.width, known.camera.height):
                columns, rows = found.size
                raise UserError(
                    f"{folder}: images are {columns} x {rows}, its camera_info says "
                    f"{known.camera.width} x {known.camera.height}: give it the intrinsics of these images"
                )
            stamps = [_stamp(folder, name) for name in found.names]
            for detection in found.detections:
                yield replace(detection, stamp=stamps[int(detection.stamp)]), None
        if self.keep is not None:
            cache.save(self.keep)


def read_detections(path: Path, notes: Notes) -> Iterator[tuple[Detection, int | None]]:
    """Yield what cameras saw, with the number of the stop when it is known; malformed lines are noted and left out.

    Parameters
    ----------
    path
        detections.jsonl, maybe gzipped.
    notes
        Take what is left out.

    Raises
    ------
    UserError
        When the file cannot be read.
    """
    decoder = msgspec.json.Decoder(_Line)
    for number, line in enumerate(read_bytes(path).splitlines(), 1):
        if not line.strip():
            continue
        try:
            found = decoder.decode(line)
            yield _detection(found), found.stop
        except (msgspec.DecodeError, ValueError) as error:
            notes.reject(f"{path.name}:{number}", str(error), error)


def open_network(path: Path) -> NetworkRecording:
    """Open a survey.

    Raises
    ------
    UserError
        In one line, when the folder or one of its files is missing or makes no sense.
    """
    found = open_setup(path)
    if (path / LIVE).exists():
        return found
    _only(path, "odometry.*")
    if not (path / "images").is_dir():
        _only(path, "detections.jsonl*")
    return found


def open_setup(path: Path) -> NetworkRecording:
    """Open what a survey begins with: target and intrinsics, no messages yet.

    Raises
    ------
    UserError
        As :func:`open_network`.
    """
    if not path.is_dir():
        raise UserError(f"{path}: no such folder: a survey is a folder, see docs/reference/camera_network.md")
    infos = sorted((path / "cameras").glob("*.yaml"))
    if not infos:
        raise UserError(f"{path / 'cameras'}: no NAME.yaml: put the camera_info of each camera there")
    cameras = tuple(_known(info) for info in infos)
    return NetworkRecording(path, read_target(_only(path, "target.*")), cameras)


def write_network(
    path: Path,
    target: Target,
    cameras: tuple[KnownCamera, ...],
    messages: Iterator[tuple[Odometry | Detection, int | None]],
) -> int:
    """Write a survey as a folder, which may exist; return the number of detections.

    Raises
    ------
    UserError
        When it cannot be written.
    """
    try:
        (path / "cameras").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{path}: cannot be made ({error.strerror}): choose another with -o") from error
    write_panels(path / "target.toml", target)
    for known in cameras:
        write_camera_info(path / "cameras" / f"{known.name}.yaml", known.name, known.camera)
        if known.covariance is not None:
            write_covariance(path / "cameras" / f"{known.name}.json", known.camera, known.covariance)
    odometry: list[Odometry] = []
    lines: list[str] = []
    for message, stop in messages:
        if isinstance(message, Odometry):
            odometry.append(message)
        else:
            lines.append(_text(message, stop))
    write_recording(path / "odometry.csv", odometry)
    write_text(path / "detections.jsonl", "".join(f"{line}\n" for line in lines))
    return len(lines)


def write_covariance(path: Path, camera: Camera, covariance: Array) -> None:
    """Write the covariance of a camera's parameters, with their names."""
    names = json.dumps(list(camera.names))
    rows = ",\n".join(json.dumps(row) for row in covariance.tolist())
    write_text(path, f'{{"version":1,"parameters":{names},"covariance":[\n{rows}\n]}}\n')


def read_covariance(path: Path, camera: Camera) -> Array:
    """Read the covariance of a camera's parameters, in the order of its lens; what is not in the file is exact.

    Raises
    ------
    UserError
        When it cannot be read, has other parameters, is not symmetric or has a negative variance.
    """
    try:
        found = msgspec.json.decode(read_bytes(path), type=_Covariance)
        covariance = np.array(found.covariance, dtype=np.float64)
    except (msgspec.DecodeError, ValueError) as error:
        raise UserError(f"{path}: not a covariance of parameters: {error}") from error
    if found.version != 1:
        raise UserError(f"{path}: version {found.version} of the format, this is 1")
    if not set(found.parameters) <= set(camera.names) or covariance.shape != (len(set(found.parameters)),) * 2:
        raise UserError(f"{path}: parameters must be among {', '.join(camera.names)}, with as many rows and columns")
    symmetric = np.allclose(covariance, covariance.T, rtol=1e-6, atol=1e-12)
    if not (np.isfinite(covariance).all() and symmetric and (np.diag(covariance) >= 0).all()):
        raise UserError(f"{path}: is no covariance: it must be finite, symmetric, its diagonal not negative")
    order = [camera.names.index(name) for name in found.parameters]
    full = np.zeros((len(camera.names), len(camera.names)))
    full[np.ix_(order, order)] = covariance
    return full


def _known(info: Path) -> KnownCamera:
    _, camera = read_camera_info(info)
    spread = info.with_suffix(".json")
    return KnownCamera(info.stem, camera, read_covariance(spread, camera) if spread.exists() else None)


def _only(folder: Path, pattern: str) -> Path:
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        raise UserError(f"{folder}: {len(found)} files {pattern}: there must be one")
    return found[0]


def _stamp(folder: Path, name: str) -> float:
    try:
        stamp = float(Path(name).stem)
    except ValueError:
        stamp = math.nan
    if not math.isfinite(stamp):
        raise UserError(
            f"{folder / name}: an image is named by the time of its exposure in seconds, such as 100.250.png"
        )
    return stamp


def _detection(line: _Line) -> Detection:
    count = len(line.ids)
    sigma = np.full(count, line.sigma) if isinstance(line.sigma, float) else np.array(line.sigma)
    if not count == len(line.u) == len(line.v) == len(sigma):
        raise ValueError(f"{count} ids for {len(line.u)} u, {len(line.v)} v and {len(sigma)} sigmas")
    pixels = np.column_stack([line.u, line.v]).astype(np.float64).reshape(-1, 2)
    return Detection(line.stamp, line.camera, line.panel, np.array(line.ids, dtype=np.int64), pixels, sigma)


def _text(d: Detection, stop: int | None) -> str:
    alike = len(d.sigma) > 0 and (d.sigma == d.sigma[0]).all()
    line = _Line(
        stamp=float(d.stamp),
        camera=d.camera,
        panel=d.panel,
        ids=tuple(map(int, d.corners)),
        u=tuple(map(float, d.pixels[:, 0])),
        v=tuple(map(float, d.pixels[:, 1])),
        sigma=float(d.sigma[0]) if alike else tuple(map(float, d.sigma)),
        stop=stop,
    )
    return msgspec.json.encode(line).decode()

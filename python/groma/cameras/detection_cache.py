"""Detections kept between runs: finding corners is slow, and the same image has the same corners.

One JSON file for a target and the gates of detection, ``detections-<hash>.json``; in it, by the hash of each image,
what was seen and what was left out. A file that cannot be read is made anew. The hash of the file holds target, gates
and the version of the detector, so that nothing stale is ever used.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np

from groma.cameras.vision import VERSION
from groma.io.atomic import write_bytes
from groma.nouns.detection import Detection
from groma.nouns.target import Target

Found = tuple[list[Detection], Counter[str]]


class _Panel(msgspec.Struct):
    panel: str
    corners: list[int]
    u: list[float]
    v: list[float]
    sigma: list[float]


class _Image(msgspec.Struct):
    panels: list[_Panel]
    left_out: dict[str, int]


class DetectionCache:
    """Detections by image, for one target and one set of gates."""

    def __init__(self, directory: Path, target: Target, gates: Mapping[str, object]) -> None:
        what = json.dumps([VERSION, target.json(), dict(sorted(gates.items()))])
        self.name = f"detections-{hashlib.sha256(what.encode()).hexdigest()[:12]}.json"
        self._images: dict[str, _Image] = {}
        with suppress(OSError, msgspec.MsgspecError, UnicodeDecodeError):
            self._images = msgspec.json.decode((directory / self.name).read_bytes(), type=dict[str, _Image])
        self.used = 0
        """Images whose detections were there already."""

    def get(self, key: str, camera: str, stamp: float) -> Found | None:
        """Return what was seen in an image, if it is known."""
        image = self._images.get(key)
        if image is None:
            return None
        self.used += 1
        return [_detection(panel, camera, stamp) for panel in image.panels], Counter(image.left_out)

    def put(self, key: str, detections: Sequence[Detection], left_out: Counter[str]) -> None:
        """Keep what was seen in an image."""
        self._images[key] = _Image([_panel(d) for d in detections], dict(left_out))

    def save(self, directory: Path) -> None:
        """Write the file into a folder.

        Raises
        ------
        UserError
            When it cannot be written.
        """
        write_bytes(directory / self.name, msgspec.json.encode(dict(sorted(self._images.items()))) + b"\n")


def _panel(detection: Detection) -> _Panel:
    u, v = detection.pixels.T.tolist()
    return _Panel(detection.panel, detection.corners.tolist(), u, v, detection.sigma.tolist())


def _detection(panel: _Panel, camera: str, stamp: float) -> Detection:
    pixels = np.column_stack([panel.u, panel.v])
    return Detection(stamp, camera, panel.panel, np.array(panel.corners), pixels, np.array(panel.sigma))

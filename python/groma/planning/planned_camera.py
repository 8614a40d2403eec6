"""The camera that a drive is planned for: of a network, from its intrinsics, or an ordinary one; and what it saw."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from groma.cameras.survey import read_covariance, read_detections
from groma.errors import UserError
from groma.io.camera_info import read_camera_info
from groma.io.network_file import read_network, without_k3
from groma.io.notes import Notes
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.poses import Pose
from groma.nouns.target import Target
from groma.planning.camera import DEFAULTS, mount
from groma.planning.floor import Mount, foot_and_mount


@dataclass(frozen=True, slots=True)
class Asked:
    """The camera that is planned for."""

    camera: Camera
    covariance: Array | None
    mount: Mount
    foot: Pose = (0.0, 0.0, 0.0)
    name: str | None = None


def mapped(path: Path, name: str | None, height: float | None, down: float | None) -> Asked:
    """Return a camera of a network.json.

    Raises
    ------
    UserError
        When it has none of that name, or one that no robot can drive before.
    """
    if height is not None or down is not None:
        raise UserError(f"{path}: says where the camera is: leave out --height and --down")
    cameras = {camera.name: camera for camera in read_network(path)[0] if camera.current}
    if name is None and len(cameras) == 1:
        name = next(iter(cameras))
    if name is None or name not in cameras:
        raise UserError(f"{path}: give --name, one of {', '.join(cameras) or 'none'}")
    chosen = cameras[name]
    placed = foot_and_mount(chosen.pose.tolist())
    if placed is None:
        raise UserError(f"{path}: {name} is below the floor or looks straight down: no drive is planned for that")
    return Asked(chosen.camera, chosen.intrinsics_covariance, placed[1], placed[0], name)


def described(
    intrinsics: Path | None, image: tuple[int, int] | None, focal: float | None, height: float, down: float
) -> Asked:
    """Return a camera whose place is said: its height [m] and how far it looks down [deg]."""
    known, covariance = _camera(intrinsics, image, focal)
    name = None if intrinsics is None else intrinsics.stem
    return Asked(known, covariance, mount(height, math.radians(down)), name=name)


def _camera(intrinsics: Path | None, image: tuple[int, int] | None, focal: float | None) -> tuple[Camera, Array | None]:
    if intrinsics is not None:
        if image is not None or focal is not None:
            raise UserError("give either intrinsics or --image and --focal")
        known, spread = without_k3(read_camera_info(intrinsics)[1]), intrinsics.with_suffix(".json")
        return known, read_covariance(spread, known) if spread.exists() else None
    if image is None and focal is None:
        return DEFAULTS.camera, None
    if image is None or focal is None:
        raise UserError("--image and --focal go together: --image 1280 720 --focal 900")
    (width, height), lens = image, DEFAULTS.camera.lens
    rest = (0.0,) * (len(DEFAULTS.camera.parameters) - 4)
    try:
        return Camera(width, height, lens, (focal, focal, (width - 1) / 2, (height - 1) / 2, *rest)), None
    except (ValueError, OverflowError) as error:
        raise UserError(f"--image, --focal: {error}") from error


def read_seen(path: Path, name: str | None, target: Target, notes: Notes) -> list[Detection]:
    """Return what the camera saw of the target; of all cameras there must be only one when it has no name.

    Raises
    ------
    UserError
        When that is nothing, or of another target.
    """
    found = [detection for detection, _ in read_detections(path, notes)]
    names = sorted({detection.camera for detection in found})
    if name is None and len(names) > 1:
        raise UserError(f"{path}: is of {len(names)} cameras: give the intrinsics of one, {names[0]}.yaml")
    own = [detection for detection in found if name in (None, detection.camera)]
    if not own:
        raise UserError(f"{path}: nothing that {name or 'a camera'} saw; there are {', '.join(names) or 'none'}")
    corners = {panel.name: len(panel.corners) for panel in target.panels}
    for detection in own:
        if detection.panel not in corners:
            raise UserError(f"{path}: panel {detection.panel!r} is none of the target: {', '.join(corners)}")
        if detection.corners.max(initial=0) >= corners[detection.panel]:
            raise UserError(f"{path}: panel {detection.panel!r} has {corners[detection.panel]} corners, not as many")
    return own

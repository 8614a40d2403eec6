"""Simulated networks of cameras, and the robot that carries a target past them.

A scene (:data:`SCENES`) has cameras, a target with several panels, a route of stops and what is wrong with it all; its
values, the defaults included, are those of the Rust core. The same scene gives the same numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np

from groma import _core
from groma.errors import UserError
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.messages import Odometry
from groma.nouns.network import KnownCamera
from groma.nouns.target import Target

SCENES: tuple[str, ...] = tuple(_core.network_scenes())
"""corridor: 50 m one way, seven cameras. loop, laps: a loop of 50 m, eight cameras, once and three times. hallway: 50 m
of hallways in a loop, seven cameras, ten times, with better wheels."""


class SceneCamera(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A camera of the building."""

    name: str
    camera: Camera
    """The assumed lens."""
    position: tuple[float, float, float]
    """In the map [m]."""
    heading: float
    """Of the optical axis [rad]."""
    down: float
    """How far the axis looks below the horizon [rad]."""


class WalkNoise(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The random walk of odometry."""

    along: float
    """[m/sqrt(m)]."""
    across: float
    heading: float
    """[rad/sqrt(m)]."""
    turning: float
    """[rad/sqrt(rad)]."""


class NetworkNoise(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is wrong: standard deviations."""

    odometry: WalkNoise
    corner: float
    """[pixel]."""
    floor_height: float
    """Height of the robot at a stop [m]."""
    floor_tilt: float
    """Its roll and pitch [rad]."""
    focal: float
    """Relative, of each camera."""
    mount: float
    """Position of the target on the robot [m]."""
    mount_turn: float
    """Its rotation [rad]."""
    view: tuple[float, float]
    """Error of each view's pose that no corner noise explains [m, rad]."""


class Bump(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A camera that is hit on the way."""

    camera: str
    stop: int
    """From this stop on."""
    motion: tuple[float, float, float, float, float, float]
    """In its own frame: translation [m], rotation vector [rad]."""


class NetworkScene(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Everything that a simulation depends on; ``msgspec.structs.replace`` changes it."""

    seed: int
    cameras: tuple[SceneCamera, ...]
    target: Target
    stops: tuple[tuple[float, float, float], ...]
    """x, y, heading; the first is (0, 0, 0)."""
    noise: NetworkNoise
    frames: int
    """Images that each camera takes at a stop."""
    bump: Bump | None = None

    def known(self) -> tuple[KnownCamera, ...]:
        """Return what is known of the cameras before the survey."""
        return tuple(KnownCamera(c.name, c.camera, self._covariance(c.camera)) for c in self.cameras)

    def settings(self) -> dict[str, object]:
        """Return the settings of a survey that say what is wrong with this scene, no more and no less."""
        noise = self.noise
        return {
            "odometry": msgspec.to_builtins(noise.odometry),
            "floor": {"height": noise.floor_height, "tilt": noise.floor_tilt},
            "mount": {"position": noise.mount, "height": noise.mount, "rotation": noise.mount_turn},
            "view": {"position": noise.view[0], "rotation": noise.view[1]},
        }

    def _covariance(self, camera: Camera) -> Array:
        direction = np.zeros(len(camera.parameters))
        direction[:2] = np.array(camera.parameters[:2]) * self.noise.focal
        return np.outer(direction, direction)


@dataclass(frozen=True, slots=True)
class SimulatedNetwork:
    """A simulated survey and its truth."""

    scene: NetworkScene
    odometry: Array
    """(N, 4) stamp, x, y, theta."""
    stop_times: Array
    """(S, 2) begin and end of each stop [s]."""
    stops: Array
    """(S, 7) true ``T_map_base`` there."""
    cameras: Array
    """(C, 7) true ``T_map_camera`` at the end."""
    lenses: tuple[Camera, ...]
    """True intrinsics."""
    mount: Array
    """(7,) true error of the target on the robot."""
    detections: tuple[tuple[int, Detection], ...]
    """Number of the stop, and what was seen there, in order of time."""

    def messages(self) -> Iterator[tuple[Odometry | Detection, int | None]]:
        """Yield what a recorder has, with the stop of each detection."""
        for stamp, x, y, theta in self.odometry:
            yield Odometry(stamp, "/odom", x, y, theta), None
        for stop, detection in self.detections:
            yield detection, stop


def network_scene(name: str, seed: int = 1) -> NetworkScene:
    """Return the scene of a name.

    Raises
    ------
    UserError
        When there is none.
    """
    try:
        return msgspec.json.decode(_core.network_scene(name, seed), type=NetworkScene)
    except ValueError as error:
        raise UserError(str(error)) from error


def simulate_network(scene: NetworkScene) -> SimulatedNetwork:
    """Drive through a scene; each camera draws the corners that it sees, with noise.

    Raises
    ------
    UserError
        When the scene makes no sense.
    """
    try:
        arrays = _core.simulate_network(msgspec.json.encode(scene).decode())
    except ValueError as error:
        raise UserError(f"scene: {error}") from error
    ends = np.cumsum(arrays.heads[:, 3])
    rows = zip(arrays.heads, arrays.stamps, ends, strict=True)
    detections = tuple(
        (
            int(stop),
            Detection(
                stamp=float(stamp),
                camera=scene.cameras[camera].name,
                panel=scene.target.panels[panel].name,
                corners=arrays.ids[end - count : end],
                pixels=arrays.pixels[end - count : end],
                sigma=np.full(count, max(scene.noise.corner, 0.01)),
            ),
        )
        for (stop, camera, panel, count), stamp, end in rows
    )
    return SimulatedNetwork(
        scene=scene,
        odometry=arrays.odometry,
        stop_times=arrays.stop_times,
        stops=arrays.stops,
        cameras=arrays.cameras,
        lenses=tuple(msgspec.json.decode(lens, type=Camera) for lens in arrays.lenses),
        mount=arrays.mount[0],
        detections=detections,
    )

"""Rendered images of a target, for tests: a camera, a panel, and poses all over the view."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from groma.nouns.camera import Camera
from groma.nouns.target import Panel, TagGrid, Target
from groma.simulation.rendering import appearance, render

Array = NDArray[np.float64]

CAMERA = Camera(640, 480, "radtan", (600.0, 606.0, 322.0, 237.0, -0.25, 0.08, 0.001, -0.0005))
TARGET = Target((Panel("panel", TagGrid(columns=6, rows=6, size=0.08, spacing=0.3)),))


def rotation(vector: Array) -> Array:
    """Return the rotation matrix of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn: Array = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return turn


def poses(count: int, seed: int, tilt: float = 0.55) -> list[Array]:
    """Return poses ``T_camera_panel`` (4, 4): tilted all ways, wandering over the image."""
    random = np.random.default_rng(seed)
    found = []
    for k in range(count):
        azimuth = 2.4 * k
        turn = rotation(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])) @ np.diag([1.0, -1.0, -1.0])
        spin = rotation(np.array([0.0, 0.0, random.uniform(-0.5, 0.5)]))
        pose = np.eye(4)
        pose[:3, :3] = turn @ spin
        middle = CAMERA.unproject(np.array([[random.uniform(200, 440), random.uniform(160, 320)]]))[0]
        pose[:3, 3] = middle * random.uniform(1.0, 1.4) - pose[:3, :3] @ [0.3, 0.3, 0.0]
        found.append(pose)
    return found


def write_images(directory: Path, places: list[Array], *, blur: float = 0.7, noise: float = 3.0) -> None:
    """Render an image a pose into a folder that is made."""
    directory.mkdir()
    look = appearance(blur=blur, noise=noise)
    for k, pose in enumerate(places):
        Image.fromarray(render(CAMERA, TARGET, [pose], look, seed=k)).save(directory / f"view{k}.png")

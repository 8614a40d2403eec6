"""Long work of the core ends soon after its token was cancelled, from whatever thread, and nothing hangs."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest

from groma import _core
from groma.planning.camera import DEFAULTS, Stage, mount
from groma.simulation.scenes import scenario

SOON = 2.0
"""The work looks at its token every 100 ms; the rest is for a busy machine [s]."""
BEGUN = 0.3


def simulated(token: _core.Token) -> None:
    _core.simulate_scenario(msgspec.json.encode(scenario("loop", 1)).decode(), token)


def studied(token: _core.Token) -> None:
    _core.camera_study(json.dumps({}), json.dumps({"runs": 100_000}), token)


def tried(token: _core.Token) -> None:
    stage = msgspec.json.encode(Stage(mount(2.0, 0.43))).decode()
    _core.camera_trials(stage, "star", 2.6, json.dumps({"runs": 100_000}), token)


def explored(token: _core.Token) -> None:
    graph = _core.exploration_scene(json.dumps({"kind": "sparse", "size": 25}))
    walk = [edge for run in [json.loads(_core.exploration_run(graph, "{}", None))] for edge in
            (stop["edge"] for stop in run["stops"]) if edge is not None]  # fmt: skip
    noise = json.loads(_core.exploration_defaults())["noise"]
    _core.exploration_try(graph, walk, json.dumps(noise), 10_000_000, 1, None, token)


def calibrated(token: _core.Token) -> None:
    random = np.random.default_rng(1)
    corner = np.stack([*np.meshgrid(np.arange(12) * 0.08, np.arange(12) * 0.08), np.zeros((12, 12))], -1).reshape(-1, 3)
    views, pixels = [], []
    for k in range(400):
        pose = np.array([-0.4, -0.4, 1.5]) + random.normal(0, 0.1, 3)
        turned = corner @ turn(random.normal(0, 0.3, 3)).T + pose
        pixels.append(DEFAULTS.camera.project(turned) + random.normal(0, 0.3, (len(corner), 2)))
        views.append((k, len(corner)))
    points = np.tile(corner, (len(views), 1))
    options = json.dumps({"splits": 10_000})
    _core.calibrate_camera((640, 480), views, points, np.vstack(pixels), np.full(len(points), 0.3), options, token)


def turn(vector: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix: np.ndarray = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return matrix


@pytest.mark.parametrize("work", [simulated, studied, tried, explored, calibrated], ids=lambda work: work.__name__)
def test_work_ends_soon_after_it_was_cancelled(work: Callable[[_core.Token], Any]) -> None:
    token = _core.Token()
    cancelled: list[float] = []

    def cancel() -> None:
        cancelled.append(time.monotonic())
        token.cancel()

    timer = threading.Timer(BEGUN, cancel)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        work(token)
    timer.cancel()
    assert cancelled, "the work ended before it was cancelled: it shows nothing"
    assert time.monotonic() - cancelled[0] < SOON


def test_progress_is_counted() -> None:
    token = _core.Token()
    small = scenario("turns", 1)
    _core.simulate_scenario(msgspec.json.encode(small).decode(), token)
    done, total = token.progress
    assert done == total > 10

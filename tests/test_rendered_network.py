"""A simulated survey whose cameras take images."""

from __future__ import annotations

import msgspec
import numpy as np

from groma.nouns.detection import Detection
from groma.simulation.network import network_scene, simulate_network
from groma.simulation.rendered_network import rendered_messages


def test_the_detector_sees_what_the_fast_mode_draws() -> None:
    scene = network_scene("corridor", 1)
    quiet = msgspec.structs.replace(scene.noise, view=(0.0, 0.0), corner=0.0)
    scene = msgspec.structs.replace(scene, cameras=scene.cameras[:1], stops=scene.stops[:4], noise=quiet)
    simulated = simulate_network(scene)
    kept: list[tuple[str, int]] = []
    rendered = [
        (stop, message)
        for message, stop in rendered_messages(simulated, keep=lambda camera, stop, _: kept.append((camera, stop)))
        if isinstance(message, Detection)
    ]
    assert rendered
    assert kept
    drawn = {(stop, seen.panel): seen for stop, seen in simulated.detections}
    for stop, seen in rendered:
        assert stop is not None
        fast = drawn[stop, seen.panel]
        both, here, there = np.intersect1d(seen.corners, fast.corners, return_indices=True)
        assert len(both) > 20
        assert np.sqrt(np.mean((seen.pixels[here] - fast.pixels[there]) ** 2)) < 0.2

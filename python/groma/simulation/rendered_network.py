"""A simulated survey whose cameras take images: the corners are those that the real detector finds in them."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import msgspec

from groma import _core
from groma.cameras.vision import detect
from groma.nouns.arrays import Gray
from groma.nouns.detection import Detection
from groma.nouns.messages import Odometry
from groma.simulation.network import SimulatedNetwork
from groma.simulation.rendering import Appearance, appearance

A = TypeVar("A")
B = TypeVar("B")
Keep = Callable[[str, int, Gray], None]
"""Called with camera, number of the stop and image (height, width)."""


def rendered_messages(
    simulated: SimulatedNetwork, look: Appearance | None = None, keep: Keep | None = None
) -> Iterator[tuple[Odometry | Detection, int | None]]:
    """Yield the odometry of a simulated survey, then what is detected in its images, by stop and camera.

    A camera takes one image at a stop. The errors of poses that no corner noise explains, which the fast mode draws,
    are not in the images.

    Parameters
    ----------
    simulated
        The survey.
    look
        See :func:`groma.simulation.rendering.appearance`.
    keep
        Told of every image.

    Raises
    ------
    ValueError
        When a panel cannot be drawn.
    """
    yield from ((message, stop) for message, stop in simulated.messages() if isinstance(message, Odometry))
    scene = simulated.scene
    renderer = _core.NetworkRenderer(
        msgspec.json.encode(scene).decode(), msgspec.json.encode(look or appearance()).decode()
    )

    def take(place: tuple[int, int]) -> tuple[Gray | None, list[Detection]]:
        stop, camera = place
        pixels = renderer.image(stop, camera)
        if pixels is None:
            return None, []
        size = scene.cameras[camera].camera
        image = pixels.reshape(size.height, size.width)
        stamp = float(simulated.stop_times[stop].mean())
        return image, detect(image, scene.target, camera=scene.cameras[camera].name, stamp=stamp)[0]

    places = [(stop, camera) for stop in range(len(simulated.stops)) for camera in range(len(scene.cameras))]
    for (stop, camera), (image, detections) in zip(places, _side_by_side(take, places), strict=True):
        if keep is not None and image is not None:
            keep(scene.cameras[camera].name, stop, image)
        yield from ((detection, stop) for detection in detections)


def _side_by_side(work: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """Yield the results for items in their order, computed on threads a few items ahead."""
    threads = os.cpu_count() or 1
    ahead: deque[Future[B]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for item in items:
                ahead.append(pool.submit(work, item))
                if len(ahead) > 2 * threads:
                    yield ahead.popleft().result()
            while ahead:
                yield ahead.popleft().result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

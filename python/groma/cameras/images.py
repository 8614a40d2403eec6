"""From images to detections, in parallel, with what was seen where."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

from groma.cameras.detection_cache import DetectionCache, Found
from groma.cameras.vision import detect
from groma.io.images import NamedImage
from groma.nouns.detection import Detection
from groma.nouns.target import Target

_AHEAD = 8
"""Images in work at a time: memory stays small however many there are."""


@dataclass(slots=True)
class Sightings:
    """What was seen in a row of images."""

    camera: str
    size: tuple[int, int] = (0, 0)
    """Columns and rows of the images."""
    names: list[str] = field(default_factory=list)
    """Of all images; the stamp of a detection is the place of its image here."""
    detections: list[Detection] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)
    """Tags and corners that were left out, by reason."""

    @property
    def empty(self) -> list[str]:
        """Names of the images in which nothing was seen."""
        seen = {int(detection.stamp) for detection in self.detections}
        return [name for k, name in enumerate(self.names) if k not in seen]


def find_targets(
    images: Iterable[NamedImage],
    target: Target,
    gates: Mapping[str, object],
    cache: DetectionCache,
    *,
    camera: str = "camera",
    progress: Callable[[int], None] | None = None,
) -> Sightings:
    """Look for the target in all images.

    Parameters
    ----------
    images
        Of one size.
    target
        What to look for.
    gates
        Those of :func:`groma.cameras.vision.detection_defaults`.
    cache
        Holds what is known already and takes what is new.
    camera
        Name that the detections bear.
    progress
        Called with the number of images done.

    Raises
    ------
    UserError
        As :func:`groma.cameras.vision.detect` and whatever reads the images.
    """
    sightings = Sightings(camera)
    waiting: list[tuple[NamedImage, Future[Found]]] = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for place, image in enumerate(images):
            waiting.append((image, pool.submit(_look, image, place, target, gates, cache, camera)))
            if len(waiting) > _AHEAD:
                _take(sightings, *waiting.pop(0), cache, progress)
        for image, future in waiting:
            _take(sightings, image, future, cache, progress)
    return sightings


def _look(
    image: NamedImage, place: int, target: Target, gates: Mapping[str, object], cache: DetectionCache, camera: str
) -> Found:
    known = cache.get(image.key, camera, float(place))
    return known or detect(image.pixels, target, camera=camera, stamp=float(place), gates=gates)


def _take(
    sightings: Sightings,
    image: NamedImage,
    future: Future[Found],
    cache: DetectionCache,
    progress: Callable[[int], None] | None,
) -> None:
    detections, left_out = future.result()
    cache.put(image.key, detections, left_out)
    sightings.size = (image.pixels.shape[1], image.pixels.shape[0])
    sightings.names.append(image.name)
    sightings.detections.extend(detections)
    sightings.left_out.update(left_out)
    if progress is not None:
        progress(len(sightings.names))

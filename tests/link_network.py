"""A camera node with made-up images on a network that loses, repeats and delays: run as a program, or in threads."""

from __future__ import annotations

import sys
import threading
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np

from groma.io.camera_protocol import Corners
from groma.link.journal import Journal
from groma.link.node import Node, new_boot
from groma.link.session import connect
from groma.link.sources import Grey

if TYPE_CHECKING:
    import zenoh


class Lossy:
    """A session whose messages suffer on the way: each has the three fates with a probability."""

    def __init__(self, session: zenoh.Session, seed: int, probability: float = 0.05) -> None:
        self._session, self._probability = session, probability
        self._random = Random(seed)  # noqa: S311

    def __getattr__(self, name: str) -> Any:
        return getattr(self._session, name)

    def put(self, key: str, data: bytes) -> None:
        lost, twice, late = (self._random.random() < self._probability for _ in range(3))
        for _ in range(0 if lost else 2 if twice else 1):
            if late:
                threading.Timer(self._random.uniform(0.1, 1.0), self._late, (key, data)).start()
            else:
                self._session.put(key, data)

    def _late(self, key: str, data: bytes) -> None:
        if not self._session.is_closed():
            self._session.put(key, data)


class Counting:
    """Images whose grey tells their number."""

    name = "made-up images"
    failures = 0

    def __init__(self) -> None:
        self._count = 0

    def take(self) -> Grey:
        self._count += 1
        return np.full((4, 6), self._count % 251, np.uint8)


def see(image: Grey) -> tuple[tuple[Corners, ...], int]:
    """Return 36 corners that depend on the grey alone."""
    u = tuple(float(image[0, 0]) + 0.125 * i for i in range(36))
    return (Corners(panel="front", ids=tuple(range(36)), u=u, v=u, sigma=(0.1,) * 36),), 0


def made_node(endpoint: str, camera: str, folder: Path, rate: float, seed: int) -> Node:
    """Return a node that has not begun."""
    boot = new_boot()
    session: Any = Lossy(connect(endpoint), seed)
    journal = Journal(folder / camera, boot)
    return Node(session, "site", camera, Counting(), see, journal, boot, rate)


if __name__ == "__main__":
    endpoint, camera, folder, rate, seed = sys.argv[1:]
    made_node(endpoint, camera, Path(folder), float(rate), int(seed)).run(threading.Event())

"""The streams of a recording: what a recording says about itself before it is read."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """What a stream carries."""

    SCAN = "laser scan"
    ODOMETRY = "odometry"
    JOINTS = "joint state"
    TRANSFORM = "transform"


@dataclass(frozen=True, slots=True)
class Stream:
    """One topic or record tag; a tag may carry two kinds (a CARMEN scan line has ranges and a robot pose)."""

    name: str
    kind: Kind
    count: int | None = None
    """Messages, when known without reading all of it."""

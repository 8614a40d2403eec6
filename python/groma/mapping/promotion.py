"""Promote persistent landmarks: those observed on several days and missing in the static map.

>>> from groma.localization.localizer import reflectors
>>> from groma.mapping.promotion import promote
>>> post = reflectors([[4.0, 1.0]], sigma=0.01)
>>> post.seen[:] = post.visible[:] = 20
>>> result = promote(reflectors([[0.0, 0.0]], sigma=0.01), [post, post])
>>> result.promoted, result.landmarks.positions.tolist()
(1, [[0.0, 0.0], [4.0, 1.0]])

Association, selection and covariance of landmarks of several days are computed in the core: docs/theory/mapping.md.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from groma import _core
from groma.errors import UserError
from groma.mapping.mapper import to_landmarks
from groma.nouns.findings import Finding, of_core
from groma.nouns.maps import Landmarks, landmark_rows


@dataclass(frozen=True, slots=True)
class Promotion:
    """The new map and how it came about."""

    landmarks: Landmarks
    """Those of the map, then the promoted ones in the order of their first day."""
    promoted: int
    confirmed: int
    """Landmarks of the map that some day saw."""
    findings: tuple[Finding, ...]


def promotion_defaults() -> dict[str, object]:
    """Return all settings of `groma promote` with their defaults."""
    defaults: dict[str, object] = json.loads(_core.promotion_defaults())
    return defaults


def promote(static: Landmarks, days: Sequence[Landmarks], settings: Mapping[str, object] | None = None) -> Promotion:
    """Add to a map what several days saw and it lacks.

    Parameters
    ----------
    static
        The map.
    days
        What was seen on each day, in the frame of the map.
    settings
        Those of :func:`promotion_defaults`; what is left out has its default.

    Raises
    ------
    UserError
        When a setting is unknown or out of range, or there are fewer days than a mark must have been seen on.
    """
    try:
        found = _core.promote(landmark_rows(static), [landmark_rows(day) for day in days], json.dumps(settings or {}))
    except ValueError as error:
        raise UserError(f"setting of promote: {error}") from error
    return Promotion(to_landmarks(found.landmarks), found.promoted, found.confirmed, of_core(found.findings))

"""The map that a drive is localized in: a folder of ``groma map``, a landmark or nav2 map, a list of reflectors."""

from __future__ import annotations

from pathlib import Path

from groma.errors import UserError
from groma.io.landmarks import read_landmarks
from groma.io.nav2_map import read_map
from groma.io.reflector_list import read_reflectors
from groma.nouns.maps import Chart, no_landmarks


def read_chart(path: Path) -> Chart:
    """Read a map.

    Parameters
    ----------
    path
        A folder with ``landmarks.json`` and, if there is one, ``map.yaml``; a landmark map (``.json``); a nav2 map
        (``.yaml``), whose walls alone constrain the pose then; or a list of reflectors (``.csv``).

    Raises
    ------
    UserError
        When it is none of these, or a file in it cannot be read.
    """
    if path.is_dir():
        landmarks, grid = path / "landmarks.json", path / "map.yaml"
        if not landmarks.exists():
            raise UserError(f"{path}: no landmarks.json in it: is it a folder of groma map?")
        return Chart(read_landmarks(landmarks), read_map(grid) if grid.exists() else None)
    if path.suffix == ".csv":
        return Chart(read_reflectors(path))
    if path.suffix == ".yaml":
        return Chart(no_landmarks(), read_map(path))
    if path.suffix == ".json":
        return Chart(read_landmarks(path))
    expected = "a folder of groma map, a landmark map (.json), a nav2 map (.yaml) or reflectors (.csv)"
    raise UserError(f"{path}: no map: expected {expected}")

"""A list of surveyed reflectors as CSV: ``x,y`` or ``x,y,sigma``, metres, a line each.

A head line that is no numbers, empty lines and lines that begin with ``#`` are left out. ``sigma`` is the standard
deviation of either coordinate; where a line has none it is that of a total station, ``SIGMA``.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.table import read_bytes
from groma.nouns.arrays import Array
from groma.nouns.bounds import in_file, require, require_all
from groma.nouns.maps import Landmarks

SIGMA = 0.003
"""Of a surveyed coordinate [m]."""


def read_reflectors(path: Path) -> Landmarks:
    """Read a list of reflectors, plain or gzipped.

    Raises
    ------
    UserError
        When the file cannot be read, a line is none (naming it), or there is no reflector in it.
    """
    lines = read_bytes(path).decode(errors="replace").splitlines()
    rows: list[tuple[float, float, float]] = []
    for number, line in enumerate(lines, 1):
        fields = [field.strip() for field in line.split(",")]
        if not line.strip() or line.lstrip().startswith("#") or (not rows and not _are_numbers(fields)):
            continue
        if not _are_numbers(fields) or len(fields) not in (2, 3):
            raise UserError(f"{path}:{number}: {line.strip()!r}: expected x,y or x,y,sigma in metres")
        values = [float(field) for field in fields]
        with in_file(path, number):
            require_all("coordinate", "x, y", values[:2])
            if len(values) == 3:
                require("sigma", "sigma", values[2])
        rows.append((values[0], values[1], values[2] if len(values) == 3 else SIGMA))
    if not rows:
        raise UserError(f"{path}: no reflector in it; expected lines of x,y or x,y,sigma in metres")
    return surveyed(np.array(rows))


def write_reflectors(path: Path, positions: Array) -> None:
    """Write positions (R, 2) with a head line, to a tenth of a millimetre."""
    write_text(path, "x,y\n" + "".join(f"{x:.4f},{y:.4f}\n" for x, y in positions.tolist()))


def surveyed(rows: Array) -> Landmarks:
    """Return reflectors at x, y with sigma (R, 3) as landmarks that are seen whenever they are in view."""
    count = len(rows)
    return Landmarks(
        kinds=np.full(count, "reflector"),
        positions=rows[:, :2].copy(),
        covariances=np.eye(2) * rows[:, 2, None, None] ** 2,
        orientations=np.full(count, np.nan),
        descriptors=np.zeros((count, 16), dtype=np.uint8),
        seen=np.ones(count, dtype=np.int64),
        visible=np.ones(count, dtype=np.int64),
    )


def _are_numbers(fields: list[str]) -> bool:
    try:
        return all(math.isfinite(float(field)) for field in fields)
    except ValueError:
        return False

"""The landmark map as JSON; the schema is documented in docs/reference/outputs.md.

Positions in metres and orientations in radians, in the frame `map`; covariances in square metres. Every number is the
shortest text that reads back as the same number, and every landmark is one line.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.atomic import write_bytes
from groma.io.table import read_bytes
from groma.nouns.bounds import in_file
from groma.nouns.maps import Landmarks

Pair = tuple[float, float]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]


class _Landmark(msgspec.Struct, omit_defaults=True):
    type: Literal["corner", "reflector"]
    position: Pair
    covariance: tuple[Pair, Pair]
    seen: Count
    visible: Count
    orientation: float | None = None
    descriptor: str | None = None


class _Units(msgspec.Struct):
    length: Literal["m"] = "m"
    angle: Literal["rad"] = "rad"


class _File(msgspec.Struct):
    version: Literal[1]
    frame: Literal["map"]
    units: _Units
    landmarks: list[_Landmark]


def write_landmarks(path: Path, landmarks: Landmarks) -> None:
    """Write a landmark map."""
    rows = [msgspec.json.encode(landmark) for landmark in _to_rows(landmarks)]
    head = b'{"version":1,"frame":"map","units":' + msgspec.json.encode(_Units()) + b',"landmarks":[\n'
    write_bytes(path, head + b",\n".join(rows) + b"\n]}\n")


def read_landmarks(path: Path) -> Landmarks:
    """Read a landmark map, plain or gzipped.

    Raises
    ------
    UserError
        When the file is not such a map, naming the place.
    """
    try:
        rows = msgspec.json.decode(read_bytes(path), type=_File).landmarks
    except msgspec.DecodeError as error:
        raise UserError(f"{path}: not a landmark map: {error}") from error
    orientations = [np.nan if row.orientation is None else row.orientation for row in rows]
    with in_file(path):
        return Landmarks(
            kinds=np.array([row.type for row in rows], dtype=np.str_),
            positions=np.array([row.position for row in rows], dtype=np.float64).reshape(-1, 2),
            covariances=np.array([row.covariance for row in rows], dtype=np.float64).reshape(-1, 2, 2),
            orientations=np.array(orientations, dtype=np.float64),
            descriptors=_to_cells(path, rows),
            seen=np.array([row.seen for row in rows], dtype=np.int64),
            visible=np.array([row.visible for row in rows], dtype=np.int64),
        )


def _to_cells(path: Path, rows: list[_Landmark]) -> NDArray[np.uint8]:
    cells = np.zeros((len(rows), 16), dtype=np.uint8)
    for place, row in enumerate(rows):
        if row.descriptor is None:
            continue
        try:
            cells[place] = np.frombuffer(bytes.fromhex(row.descriptor), dtype=np.uint8)
        except ValueError as error:
            message = f"{path}: not a landmark map: a descriptor is 32 hexadecimal digits - at `$.landmarks[{place}]`"
            raise UserError(message) from error
    return cells


def _to_rows(landmarks: Landmarks) -> list[_Landmark]:
    values = (
        landmarks.kinds.tolist(),
        landmarks.positions.tolist(),
        landmarks.covariances.tolist(),
        landmarks.seen.tolist(),
        landmarks.visible.tolist(),
        [None if np.isnan(angle) else angle for angle in landmarks.orientations.tolist()],
        [row.tobytes().hex() if row.any() else None for row in landmarks.descriptors],
    )
    return [_Landmark(*row) for row in zip(*values, strict=True)]

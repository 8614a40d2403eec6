"""`groma promote`: landmarks that drives of several days saw join the map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.landmarks import read_landmarks, write_landmarks
from groma.promotion import promote as promote_landmarks


def promote(
    landmarks: Path,
    /,
    *drives: Path,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    days: int | None = None,
) -> None:
    """Add to a landmark map what several localized drives saw and it lacks.

    groma promote map/landmarks.json monday tuesday wednesday -o map/landmarks.json

    Parameters
    ----------
    landmarks
        The landmark map (landmarks.json of `groma map`).
    drives
        Folders of `groma localize`, one a day, all in that map.
    output
        The new landmark map; it may be the old one.
    days
        On how many of the drives a mark must have been seen; two when left out.
    """
    seen = [read_landmarks(_landmarks(drive)) for drive in drives]
    result = promote_landmarks(read_landmarks(landmarks), seen, {} if days is None else {"days": days})
    write_landmarks(output, result.landmarks)
    size, again = len(result.landmarks.positions), result.confirmed
    print(f"{output}: {size} landmarks, {result.promoted} of them new; {again} of the old ones were seen again")


def _landmarks(drive: Path) -> Path:
    path = drive / "landmarks.json" if drive.is_dir() else drive
    if not path.exists():
        raise UserError(f"{path}: not there: is {drive} a folder of groma localize?")
    return path

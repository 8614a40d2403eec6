"""The run of a promotion: persistent landmarks are added to the map, into the folder of a run that is a map again."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from groma.errors import UserError
from groma.io.landmarks import read_landmarks, write_landmarks
from groma.mapping.promotion import promote
from groma.runs.kinds import check_kind
from groma.runs.run import Run

MARKS = "landmarks.json"
_OF_MAP = ("map.yaml", "map.pgm")
"""What is carried over from the folder of the map, so that the new one serves as a map too."""


def promote_into(run: Run, chart: Path, drives: Sequence[Path], settings: Mapping[str, object]) -> None:
    """Promote what was seen on several days and finish the run with the new map.

    Parameters
    ----------
    chart
        Folder of a map, or a landmark map.
    drives
        Folders of localized drives, one per day.
    settings
        Those of :func:`groma.mapping.promotion.promotion_defaults`.

    Raises
    ------
    UserError
        When the map or a drive is none.
    """
    check_kind(chart, "map", "promotion")
    run.inputs["input"] = chart
    for number, drive in enumerate(drives, 1):
        check_kind(drive, "localization")
        run.inputs[f"drive_{number}"] = drive
    seen = [read_landmarks(_marks(drive, "groma localize")) for drive in drives]
    run.settings = {"promote": settings}
    result = promote(read_landmarks(_marks(chart, "groma map")), seen, settings)
    run.extend(result.findings)
    write_landmarks(run.path(MARKS), result.landmarks)
    for name in _OF_MAP:
        if chart.is_dir() and (chart / name).exists():
            shutil.copyfile(chart / name, run.path(name))
    size, again = len(result.landmarks.positions), result.confirmed
    figures = {"landmarks": size, "promoted": result.promoted, "confirmed": again, "days": len(drives)}
    run.finish(figures, f"{size} landmarks, {result.promoted} of them new; {again} of the old ones were seen again.")


def _marks(place: Path, maker: str) -> Path:
    path = place / MARKS if place.is_dir() else place
    if not path.exists():
        raise UserError(f"{path}: not there: is {place} a folder of {maker}?")
    return path

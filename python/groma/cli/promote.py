"""`groma promote`: landmarks that drives of several days saw join the map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.runs.promotion import promote_into
from groma.runs.run import Run
from groma.runs.tables import settings_of


def promote(
    map_: Annotated[Path, Parameter(name="MAP")],
    /,
    *drives: Path,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    days: int | None = None,
    config: Path | None = None,
) -> None:
    """Add to a map what several localized drives saw and it lacks: a new map, the old one stays.

    groma promote results/latest-map monday tuesday wednesday -o depot

    Parameters
    ----------
    map_
        Folder of groma map, or a landmark map (.json).
    drives
        Folders of groma localize, one per day, all in that map.
    output
        Folder for the new map; a new one in results/ when left out.
    days
        On how many of the drives a mark must have been seen; two when left out.
    config
        TOML with a table [promote] (groma config prints it) or the run.toml of another run.
    """
    settings = settings_of("promote", config, days=days)
    with Run("promotion", "promote", output) as run:
        promote_into(run, map_, drives, settings)

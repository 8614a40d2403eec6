"""Which folders a run may replace: those in which a groma run wrote every file, as their ``run.toml`` lists them."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from pathlib import Path

from groma.errors import UserError

RECORD = "run.toml"


def files_below(folder: Path) -> Iterator[str]:
    """Yield the names of all files below a folder, relative to it, with ``/``; links are not followed."""
    for root, folders, names in os.walk(folder):
        links = [name for name in folders if Path(root, name).is_symlink()]
        for name in (*names, *links):
            yield Path(root, name).relative_to(folder).as_posix()


def check_replaceable(folder: Path) -> None:
    """Refuse a folder that holds anything that no groma run wrote.

    Raises
    ------
    UserError
        In one line: the first file that is not listed, and what to do.
    """
    there = sorted(files_below(folder))
    if not there:
        return
    listed = _listed(folder / RECORD)
    foreign = [name for name in there if name not in listed]
    if foreign:
        more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
        raise UserError(
            f"{folder}: {foreign[0]}{more} was not written by a groma run ({RECORD} does not list it): nothing was "
            "replaced; move it away, or choose another folder with -o"
        )


def _listed(record: Path) -> set[str]:
    try:
        files = tomllib.loads(record.read_text("utf-8")).get("files")
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return set()
    return {name for name in files if isinstance(name, str)} if isinstance(files, list) else set()

"""What a result folder is: named by its ``run.toml``, and refused where a command needs another kind."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from groma.errors import UserError
from groma.runs.ownership import RECORD

MAKERS = {
    "map": "groma map",
    "localization": "groma localize",
    "vehicle": "groma calibrate vehicle",
    "camera": "groma calibrate camera",
    "network": "groma cameras map",
    "promotion": "groma promote",
    "plan": "groma plan",
    "evaluation": "groma evaluate",
    "recording": "groma simulate",
}
"""What makes a folder of each kind."""


def check_kind(folder: Path, *kinds: str) -> None:
    """Refuse a result folder of another kind, or one without an estimate; what is none is left to its reader.

    Parameters
    ----------
    folder
        What the user named; may be a file.
    kinds
        What is required, the usual one first.

    Raises
    ------
    UserError
        In one line: what it is, and which folder or link to use.
    """
    kind = kind_of(folder)
    if kind is None:
        return
    wanted = f"name a folder of {MAKERS[kinds[0]]}, as {folder.parent / f'latest-{kinds[0]}'}"
    if kind not in kinds:
        raise UserError(f"{folder}: is a folder of {MAKERS.get(kind, kind)}, no {kinds[0]}: {wanted}")
    if _verdict_of(folder) == "no-estimate":
        raise UserError(f"{folder}: there was no estimate in that run (its report says why): {wanted}")


def file_in(path: Path, name: str, kind: str) -> Path:
    """Return a file that may be named by the result folder that holds it.

    Raises
    ------
    UserError
        When the folder is of another kind or has no such file.
    """
    if not path.is_dir():
        return path
    check_kind(path, kind)
    if not (path / name).exists():
        raise UserError(f"{path}: no {name} in it: is it a folder of {MAKERS[kind]}?")
    return path / name


def kind_of(folder: Path) -> str | None:
    """Return the kind of a result folder; None when it is none, or was made by groma 0.1."""
    try:
        kind = tomllib.loads((folder / RECORD).read_text("utf-8")).get("kind")
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return None
    return kind if isinstance(kind, str) else None


def _verdict_of(folder: Path) -> object:
    try:
        content = json.loads((folder / "metrics.json").read_text("utf-8"))
    except (OSError, ValueError):
        return None
    return content.get("verdict") if isinstance(content, dict) else None

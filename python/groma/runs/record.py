"""What made a result: versions, command, inputs with their hashes, settings. No time of day, no place on the disk."""

from __future__ import annotations

import hashlib
import platform
import shlex
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

import groma
from groma._core import Token

_WITHOUT_EFFECT = {"-o", "--output", "--threads"}
_CHUNK = 1 << 22
_SPACES = "\n\r\t"


def run_record(
    kind: str,
    command: str | None,
    inputs: Mapping[str, Path | None],
    settings: Mapping[str, object],
    token: Token | None = None,
) -> dict[str, object]:
    """Return what made a result.

    Parameters
    ----------
    kind
        What the result is (docs/reference/outputs.md).
    command
        The command line as :func:`shown_command` gives it.
    inputs
        Files and folders by what they were used for; the first is usually ``input``. None means none.
    settings
        Every setting by name, tables nested.
    token
        Ends the hashing when it is cancelled: what was not read to its end has no hash.
    """
    return {
        "groma": groma.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "kind": kind,
        "command": command,
        **{name: None if path is None else fingerprint(path, token) for name, path in inputs.items()},
        "settings": settings,
    }


def fingerprint(source: Path, token: Token | None = None) -> dict[str, object]:
    """Return name, size and SHA-256 of a file; of a folder, those of its files in the order of their names."""
    name = printable(source.resolve().name)
    if source.is_dir():
        files = sorted(path for path in source.rglob("*") if path.is_file())
        told = {printable(path.relative_to(source).as_posix()): fingerprint(path, token) for path in files}
        return {"name": name, "files": told}
    return {"name": name, "bytes": source.stat().st_size, "sha256": _sha256(source, token)}


def _sha256(source: Path, token: Token | None) -> str | None:
    digest = hashlib.sha256()
    with source.open("rb") as file:
        while chunk := file.read(_CHUNK):
            if token is not None and token.cancelled:
                return None
            digest.update(chunk)
    return digest.hexdigest()


def shown_command(arguments: Iterable[str]) -> str:
    """Return a command line as it is recorded: without the options that choose a place or a number of threads."""
    kept: list[str] = []
    silent = False
    for argument in arguments:
        name = argument.partition("=")[0]
        silenced = silent or name in _WITHOUT_EFFECT
        silent = not silent and argument in _WITHOUT_EFFECT
        if not silenced:
            kept.append(argument)
    return printable(shlex.join(["groma", *kept]))


def printable(text: str) -> str:
    """Return a text that terminals and UTF-8 files can hold: one line, no control characters, no undecodable bytes."""
    return "".join(" " if c in _SPACES else "\N{REPLACEMENT CHARACTER}" if _harms(c) else c for c in text)


def _harms(character: str) -> bool:
    return unicodedata.category(character) in ("Cc", "Cf", "Cs")

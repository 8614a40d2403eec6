"""Write a file beside its place, then rename it there: a reader sees the old file or the new one, never half of one.

Does not lock: of two writers the later one wins. The bytes are not forced to the disk (no fsync): after a power cut the
file may be lost, after a crash of the program it may not.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from groma.errors import UserError


def write_bytes(path: Path, data: bytes) -> None:
    """Replace the content of a file.

    Parameters
    ----------
    path
        The file; its directory must exist.
    data
        The whole new content.

    Raises
    ------
    UserError
        When the directory is missing, not writable or full; what was there before is untouched.
    """
    with replacing(path) as file:
        file.write(data)


def write_text(path: Path, text: str) -> None:
    r"""Replace the content of a file by UTF-8 text with ``\n`` line ends, whatever the platform."""
    write_bytes(path, text.encode())


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """Open a file to be written piece by piece; it takes its place when the block ends, and vanishes when it fails.

    Raises
    ------
    UserError
        As :func:`write_bytes`.
    """
    try:
        with _beside(path) as file:
            yield file
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise UserError(f"{path}: cannot be written ({reason}): free the place or choose another with -o") from error


@contextmanager
def _beside(path: Path) -> Iterator[IO[bytes]]:
    handle, beside = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.chmod(beside, 0o666 & ~_umask())
        os.replace(beside, path)
    except BaseException:
        os.unlink(beside)
        raise


def _umask() -> int:
    """Return the permissions that the user wants withheld; mkstemp withholds them from everybody."""
    mask = os.umask(0)
    os.umask(mask)
    return mask

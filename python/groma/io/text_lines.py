"""The lines of a text file, plain or gzipped, one at a time: memory does not grow with the file.

A compressed file that ends early yields the whole lines before the cut, and the notes say so. A line longer than
``LONGEST`` bytes is not text of any format here: it is counted as malformed and its rest is passed over.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from groma.errors import UserError
from groma.io.notes import Notes

LONGEST = 1 << 20
_GZIP_MAGIC = b"\x1f\x8b"
_PIECE = 512
_CUT = (EOFError, zlib.error, gzip.BadGzipFile)


def open_bytes(path: Path) -> IO[bytes]:
    """Open a file for reading, decompressed if its content (not its name) is gzip.

    Raises
    ------
    UserError
        When it cannot be opened.
    """
    try:
        with path.open("rb") as file:
            compressed = file.read(2) == _GZIP_MAGIC
        return cast(IO[bytes], gzip.open(path, "rb")) if compressed else path.open("rb")
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from error


def head(path: Path, size: int) -> bytes:
    """Return the first bytes of the content; fewer when the file is shorter or cut."""
    data = b""
    with open_bytes(path) as file:
        try:
            while len(data) < size and (more := file.read(min(_PIECE, size - len(data)))):
                data += more
        except _CUT as error:
            if not data:
                raise UserError(
                    f"{path}: the compressed file is damaged at its beginning ({error}): copy it again"
                ) from error
    return data


def numbered_lines(path: Path, notes: Notes) -> Iterator[tuple[int, bytes]]:
    """Yield ``(number from 1, line)`` with the line end; a cut ends the iteration and is noted."""
    number = 0
    with open_bytes(path) as file:
        try:
            for number, line in enumerate(iter(lambda: file.readline(LONGEST), b""), 1):
                if len(line) == LONGEST:
                    notes.reject(f"{path.name}:{number}", f"a line of more than {LONGEST} bytes is no text")
                    _pass_over(file)
                else:
                    yield number, line
        except _CUT as error:
            notes.cut = f"{path.name}: cut or damaged after line {number} ({error}); the lines before were read"


def _pass_over(file: IO[bytes]) -> None:
    while len(file.readline(LONGEST)) == LONGEST:
        pass

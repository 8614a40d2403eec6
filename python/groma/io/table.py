"""Lines and columns of numbers from text files, plain or gzipped (told by the content, not by the name).

`#` starts a comment; columns are separated by blanks or commas. A fault is named by file and line.
"""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from groma.errors import UserError
from groma.nouns.arrays import Array


def read_bytes(path: Path) -> bytes:
    """Return the content of a file, decompressed.

    Raises
    ------
    UserError
        When the file is missing, unreadable or cut short.
    """
    try:
        data = path.read_bytes()
        return gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise UserError(f"{path}: the compressed file is cut short or damaged: copy it again") from error
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from error


def lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the number (from 1) and the fields of every line that has any."""
    text = io.StringIO(read_bytes(path).decode(errors="replace"))
    for number, line in enumerate(text, 1):
        fields = line.partition("#")[0].replace(",", " ").split()
        if fields:
            yield number, fields


def floats(path: Path, number: int, fields: list[str]) -> list[float]:
    """Return the fields of one line as numbers; NaN and infinity pass.

    Raises
    ------
    UserError
        Naming the line, when a field is no number.
    """
    try:
        return [float(field) for field in fields]
    except ValueError as error:
        raise UserError(f"{path}:{number}: not a number: {str(error).rpartition(': ')[2]}") from error


def read_table(path: Path, columns: int) -> Array:
    """Read the first columns of a table of numbers.

    Parameters
    ----------
    path
        Text file, plain or gzipped.
    columns
        How many columns every line must have at least; more are ignored.

    Returns
    -------
    Array
        (N, columns), rows in the order of the file; N may be 0.
    """
    rows = []
    for number, fields in lines(path):
        if len(fields) < columns:
            raise UserError(f"{path}:{number}: {len(fields)} columns, expected {columns}")
        rows.append(floats(path, number, fields[:columns]))
    return np.array(rows, dtype=np.float64).reshape(-1, columns)

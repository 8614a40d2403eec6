"""Name files that are no recording of ours, so that a refusal tells a stranger what he has in hand."""

from __future__ import annotations

import re
from pathlib import Path

_MAGICS = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"MATLAB 5.0", "a MATLAB file"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"PK\x03\x04", "a zip archive: unpack it first"),
    (b"%PDF", "a PDF"),
    (b"(\xb5/\xfd", "zstd-compressed data: unpack it first"),
    (b"BZh", "bzip2-compressed data: unpack it first"),
    (b"\xfd7zXZ", "xz-compressed data: unpack it first"),
    (b"\x1f\x8b", "data compressed twice: unpack it first"),
)
_LINES = (
    (re.compile(r"(VERTEX|EDGE)(2|_)|ODOMETRY \d+ \d+ "), "a pose graph; it holds no scans"),
    (
        re.compile(r"[LO]( -?\d+\.\d+){3}"),
        "a log of Wean Hall kind (O and L lines in centimetres), which groma does not read",
    ),
    (re.compile(r"# ?UTIAS"), "a file of the MR.CLAM landmark dataset, which groma does not read"),
    (re.compile(r"\{|\["), "JSON"),
    (
        re.compile(r"(-?[\d.e+-]+\s+){100}"),
        "a table of numbers with more than a hundred columns (raw scanner or tick log without tags)",
    ),
    (re.compile(r"-?[\d.e+-]+([\s,]+-?[\d.e+-]+)+$"), "a table of numbers"),
    (re.compile(r"(\w+,)+\w+$"), "a CSV table that is not groma's own (docs/reference/csv.md)"),
)


def looks_like(path: Path, head: bytes) -> str:
    """Return what a file looks like, as the end of "this is ...".

    Parameters
    ----------
    path
        The file; only its name is looked at.
    head
        Its first bytes, decompressed.
    """
    if not head:
        return "an empty file"
    for magic, name in _MAGICS:
        if head.startswith(magic):
            return name
    if b"CSensoryFrame" in head[:64] or b"CObservation" in head[:64] or b"CActionCollection" in head[:64]:
        return "an MRPT rawlog, which groma does not read"
    if b"\0" in head:
        return "a binary file of a kind groma does not know"
    return _text(path, head.decode(errors="replace"))


def _text(path: Path, text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    for line in lines[:20]:
        for pattern, name in _LINES:
            if pattern.match(line):
                return name
    if path.suffix in (".yaml", ".yml"):
        return "a YAML file"
    first = lines[0] if lines else ""
    return f"text whose first line is {first[:40]!r}" if first else "blank text"

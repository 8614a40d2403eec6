"""What reading left out, counted by reason, as findings."""

from __future__ import annotations

from collections.abc import Mapping

from groma.nouns.findings import Finding

_CODES = (
    ("motions: ", "motions-left-out"),
    (" late", "stamps-late"),
    ("stamp", "stamps-invalid"),
    ("scans with", "scans-unusable"),
    ("repeat a time", "stamps-invalid"),
    ("no number", "values-invalid"),
    ("gaps in the readings of the wheels", "wheels-gap"),
    ("leaps of a counter", "wheels-leap"),
)
"""Codes by a part of the reason, the first that fits; the order matters."""
_ELSE = "records-skipped"


def left_out(counts: Mapping[str, float]) -> list[Finding]:
    """Return a finding a reason with a count above zero."""
    return [_finding(reason, int(count)) for reason, count in counts.items() if count]


def _finding(reason: str, count: int) -> Finding:
    codes = (code for part, code in _CODES if part in reason)
    code = next(codes, _ELSE)
    return Finding(code, f"left out: {count} {reason.removeprefix('motions: ')}", values={"count": (count, "1")})

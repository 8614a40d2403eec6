"""Findings: what was noticed about a recording or a result, and the verdict that follows.

The catalogue of codes (severity, meaning, remedy, the verdict that a code forces) is that of the core, documented in
docs/reference/findings.md. Standard error, report and ``metrics.json`` show the same list.

>>> from groma.nouns.findings import Finding, verdict
>>> found = Finding("loop-none", "no loop was closed")
>>> found.severity
'warning'
>>> verdict("map", [found])
'consistent'
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Literal, cast

from groma import _core

Severity = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Code:
    """A row of the catalogue."""

    name: str
    severity: Severity
    verdict: str | None
    """The verdict that it forces on a run."""
    meaning: str
    remedy: str
    """Empty where nothing is to be done."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that was noticed.

    Raises
    ------
    ValueError
        When the catalogue has no such code.
    """

    code: str
    text: str
    """What happened here, in one sentence without a full stop."""
    span: tuple[float, float] | None = None
    """First and last stamp [s], where it belongs to a time."""
    place: tuple[float, float] | None = None
    """Where in the frame of the result [m]."""
    values: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    """Numbers by name, each with its unit (``m``, ``rad``, ``s``, ``1`` for counts and shares)."""

    def __post_init__(self) -> None:
        if self.code not in catalogue():
            raise ValueError(f"no finding has the code {self.code}")

    @property
    def severity(self) -> Severity:
        """How much it matters: an error makes the run exit with 1."""
        return catalogue()[self.code].severity

    @property
    def remedy(self) -> str:
        """What to do; empty where nothing is to be done."""
        return catalogue()[self.code].remedy


@cache
def catalogue() -> Mapping[str, Code]:
    """Return all codes by name, those that decide a verdict first."""
    return {
        name: Code(name, cast(Severity, severity), verdict, meaning, remedy)
        for name, severity, verdict, meaning, remedy in _core.finding_catalogue()
    }


Row = tuple[str, str, tuple[float, float] | None, tuple[float, float] | None, list[tuple[str, float, str]]]
"""A finding of the core: code, text, span, place, and name, number and unit of every value."""


def of_core(found: Iterable[Row]) -> tuple[Finding, ...]:
    """Return findings of the core as values."""
    return tuple(
        Finding(code, text, span, place, {name: (value, unit) for name, value, unit in values})
        for code, text, span, place, values in found
    )


def verdict(kind: str, findings: Iterable[Finding]) -> str:
    """Return the verdict on a run of a kind: one documented word."""
    return _core.finding_verdict(kind, [finding.code for finding in findings])

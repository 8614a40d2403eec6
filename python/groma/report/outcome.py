"""What a run came to: kind, verdict, findings, headline and record, as reports and ``metrics.json`` take them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from groma.nouns.findings import Finding

Json = dict[str, object]


@dataclass(frozen=True, slots=True)
class Outcome:
    """The results of a run besides its figures."""

    kind: str
    verdict: str
    """One documented word."""
    findings: tuple[Finding, ...]
    """Errors first, then warnings, then what is only worth knowing."""
    headline: str
    """One or two sentences for a person."""
    record: Mapping[str, object]
    """The content of run.toml."""

    @property
    def source(self) -> str:
        """Name of the input."""
        source = self.record.get("input")
        return str(source["name"]) if isinstance(source, Mapping) else "no recording"


def document(kind: str, verdict: str, findings: Iterable[Finding], figures: Mapping[str, object]) -> Json:
    """Return the content of ``metrics.json``: kind, verdict and findings, then the figures by name.

    Raises
    ------
    ValueError
        When a figure has the name of one of the first three.
    """
    head: Json = {"kind": kind, "verdict": verdict, "findings": [finding_json(finding) for finding in findings]}
    if taken := head.keys() & figures.keys():
        raise ValueError(f"figures must not be called {', '.join(sorted(taken))}")
    return head | {name: _plain(figures[name]) for name in sorted(figures)}


def finding_json(finding: Finding) -> Json:
    """Return a finding as ``metrics.json`` has it (docs/reference/outputs.md)."""
    begin, end = finding.span or (None, None)
    return {
        "code": finding.code,
        "severity": finding.severity,
        "from_stamp": _plain(begin),
        "to_stamp": _plain(end),
        "place": None if finding.place is None else [_plain(x) for x in finding.place],
        "values": {name: {"value": _plain(value), "unit": unit} for name, (value, unit) in finding.values.items()},
        "text": finding.text,
        "remedy": finding.remedy,
    }


def to_json(content: Json) -> str:
    """Return the text of a document."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def _plain(value: object) -> object:
    """Return a value that JSON can hold: keys sorted, numbers of Python, nothing (null) for what is not finite."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(value[key]) for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value

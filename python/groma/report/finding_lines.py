"""Findings as lines for a person: severity, code, what happened, what to do."""

from __future__ import annotations

from collections.abc import Iterable

from groma.nouns.findings import Finding

_ORDER = {"error": 0, "warning": 1, "info": 2}


def in_order(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings with the gravest first, else in the order in which they came."""
    return sorted(findings, key=lambda finding: _ORDER[finding.severity])


def line(finding: Finding) -> str:
    """Return a finding as one line."""
    text = finding.text.removesuffix(".")
    remedy = f" {finding.remedy}" if finding.remedy else ""
    return f"{finding.severity}: {finding.code}: {text}.{remedy}"

"""The findings of a run: the same on standard error, in the report and in metrics.json."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path

from groma.nouns.findings import Finding
from groma.report.finding_lines import line

KEYS = {"code", "severity", "from_stamp", "to_stamp", "place", "values", "text", "remedy"}


def findings_shown(out: Path, standard_error: str) -> set[str]:
    """Check the folder of a run against what it said on standard error, and return the codes of its findings."""
    findings = json.loads((out / "metrics.json").read_text())["findings"]
    page = (out / "report.html").read_text()
    assert standard_error.splitlines() == [line(Finding(f["code"], f["text"])) for f in findings]
    assert all(set(finding) == KEYS for finding in findings)
    assert all(escape(finding["text"].removesuffix(".")) in page for finding in findings)
    assert not findings or "nothing was skipped" not in page
    return {finding["code"] for finding in findings}

"""Writes docs/reference/findings.md from the catalogue of the core; `make docs` runs it, a test compares."""

from __future__ import annotations

from pathlib import Path

from groma.nouns.findings import Code, catalogue, verdict
from groma.runs.kinds import MAKERS

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "findings.md"

HEAD = """# Findings and verdicts

Written by `make docs` from the catalogue of the core; do not edit.

A finding is something that a command noticed about its input or its result. Standard error prints one per line, the
report of the run shows the same list, and so does its `metrics.json` ([fields](runs.md)). A code is never renamed.

Severities: `info` is worth knowing, nothing to do; `warning` means that the result may suffer; `error` that it must not
be relied on, and the command exits with 1.

## Verdicts

The verdict is one word that follows from the findings alone. Without an objection it is the word of the kind:

| kind | made by | verdict |
|---|---|---|
"""

FORCED = """
Else it is that of the first of these findings, in this order:

| code | verdict | severity |
|---|---|---|
"""

CODES = """
## Codes

| code | severity | what it means | what to do |
|---|---|---|---|
"""


def page() -> str:
    """Return the page."""
    codes = list(catalogue().values())
    kinds = "".join(f"| `{kind}` | `{maker}` | `{verdict(kind, [])}` |\n" for kind, maker in MAKERS.items())
    forced = "".join(f"| `{c.name}` | `{c.verdict}` | {c.severity} |\n" for c in codes if c.verdict)
    return HEAD + kinds + FORCED + forced + CODES + "".join(map(_row, codes))


def _row(code: Code) -> str:
    return f"| `{code.name}` | {code.severity} | {code.meaning} | {code.remedy or 'nothing'} |\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

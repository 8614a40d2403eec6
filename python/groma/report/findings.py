"""The findings of a run on its page: the list that standard error and ``metrics.json`` show, in the same order."""

from __future__ import annotations

from collections.abc import Sequence

from groma.nouns.findings import Finding
from groma.report.page import Html, section, text


def findings_section(findings: Sequence[Finding]) -> Html:
    """Return the section; without findings it says so."""
    if not findings:
        return section("Findings", text("p", "None: nothing was skipped or assumed."))
    return section("Findings", Html('<ul class="findings">\n' + "\n".join(map(_item, findings)) + "\n</ul>"))


def _item(finding: Finding) -> Html:
    sentence = finding.text.removesuffix(".") + "."
    remedy = text("em", finding.remedy) if finding.remedy else ""
    words = f"{text('b', finding.severity)} {text('code', finding.code)}"
    return Html(f'<li class="{finding.severity}">{words}<p>{text("span", sentence)} {remedy}</p></li>')

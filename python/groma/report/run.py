"""The report of a run that has no page of its own: headline, findings, files and settings."""

from __future__ import annotations

from collections.abc import Callable

from groma.io.toml import to_toml
from groma.report.findings import findings_section
from groma.report.outcome import Outcome
from groma.report.page import Html, details, page, section, text


def plain_report(name: str, *parts: Html) -> Callable[[Outcome], str]:
    """Return what makes the page of a command, named without ``groma``, with more parts to show below the findings."""

    def report(outcome: Outcome) -> str:
        title = f"groma {name} · {outcome.source}"
        head = f"<header>\n{text('p', title, 'over')}\n{text('h1', outcome.headline or outcome.verdict)}\n</header>"
        settings = details("Settings, versions, input", text("pre", to_toml(outcome.record)))
        return page(title, [Html(head), findings_section(outcome.findings), *parts, section("Settings", settings)])

    return report

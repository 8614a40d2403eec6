"""Findings: a catalogue that programs can rely on, and the verdict that follows from it."""

import pytest

from groma.nouns.findings import Finding, catalogue, verdict

SEVERITY = ["info", "warning", "error"]


def test_severity_and_remedy_come_from_the_catalogue() -> None:
    torn = Finding("map-torn", "the scan was not found on the map", span=(1.0, 2.0), values={"gap": (1.0, "s")})
    assert (torn.severity, bool(torn.remedy)) == ("error", True)


def test_an_unknown_code_is_refused() -> None:
    with pytest.raises(ValueError, match="no finding has the code nonsense"):
        Finding("nonsense", "")


def test_the_weightiest_finding_decides() -> None:
    weak, torn, cut = (Finding(code, "") for code in ("weak-stretch", "map-torn", "interrupted"))
    assert verdict("map", []) == verdict("map", [weak]) == "consistent"
    assert verdict("map", [weak, torn]) == "torn"
    assert verdict("map", [torn, cut]) == "interrupted"
    with pytest.raises(ValueError, match="no kind of run is called poem"):
        verdict("poem", [])


def test_whatever_asks_for_action_says_which() -> None:
    assert all(code.severity in SEVERITY and code.meaning for code in catalogue().values())
    assert all(code.remedy for code in catalogue().values() if code.severity == "error")

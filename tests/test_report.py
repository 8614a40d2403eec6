from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

from groma.mapping.result import Closure, MapResult, PoseGraph
from groma.nouns.findings import Finding
from groma.nouns.maps import Landmarks, OccupancyGrid
from groma.report import words
from groma.report.drawing import thinned
from groma.report.map import words as map_words
from groma.report.map.figures import map_figures
from groma.report.map.report import map_report
from groma.report.outcome import Outcome
from groma.report.plan import shrunk
from ring_corridor import ring_corridor

RUN: dict[str, object] = {"groma": "0.0", "input": {"name": "day<1>.log"}, "settings": {"note": "a & <b>"}}
FINDINGS = (Finding("recording-cut", "cut after <message> 7"), Finding("records-skipped", "skipped: 3 NEFF"))


def outcome(result: MapResult, *findings: Finding, record: dict[str, object] = RUN) -> Outcome:
    return Outcome("map", "consistent", findings, map_words.verdict(result), record)


class _Balance(HTMLParser):
    """Collects what a page would load, and whether every element is closed."""

    VOID = frozenset({"meta", "link", "br", "img", "input", "hr"})

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_startendtag(tag, attrs)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href")]
        self.ids += [value or "" for name, value in attrs if name == "id"]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def result() -> MapResult:
    return ring_corridor()


@pytest.fixture(scope="module")
def page(result: MapResult) -> str:
    return map_report(result, outcome(result, *FINDINGS))


def test_page_is_well_formed_and_loads_nothing(page: str) -> None:
    parsed = _Balance(page)
    assert parsed.open == []
    assert not parsed.tags & {"script", "link", "img", "iframe"}
    assert parsed.references
    assert all(reference.startswith(("#", "data:image/png;base64,")) for reference in parsed.references)
    assert len(set(parsed.ids)) == len(parsed.ids)
    assert {reference[1:] for reference in parsed.references if reference[0] == "#"} <= set(parsed.ids)
    assert set(re.findall(r"url\(#(\w+)\)", page)) <= set(parsed.ids)


def test_text_from_outside_is_escaped(page: str) -> None:
    assert "day&lt;1&gt;.log" in page
    assert "a &amp; &lt;b&gt;" in page
    assert "few returns &amp; &lt;glass&gt;" in page
    assert "<glass>" not in page


def test_figures_take_the_colours_of_the_page(page: str) -> None:
    body = page[page.index("<body>") :]
    assert body.count("<svg") == 4
    assert "image-rendering" not in body
    assert "font-family" not in body
    assert re.findall(r"#[0-9a-f]{6}\b", body) == []
    variables = set(re.findall(r"var\(--(\w+)\)", page))
    assert variables - {"c"} <= set(re.findall(r"--(\w+): #", page))


def test_same_bytes_in_another_process(page: str) -> None:
    code = (
        "import sys; from ring_corridor import ring_corridor; from test_report import FINDINGS, outcome;"
        "from groma.report.map.report import map_report; result = ring_corridor();"
        "sys.stdout.reconfigure(encoding='utf-8');"
        "sys.stdout.write(map_report(result, outcome(result, *FINDINGS)))"
    )
    environment = {"PYTHONHASHSEED": "5", "PYTHONPATH": str(Path(__file__).parent), "TZ": "Asia/Tokyo"}
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, env=environment, check=True).stdout
    assert other.decode() == page


def test_drawing_leaves_the_settings_of_others_alone_and_ignores_them(result: MapResult, page: str) -> None:
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "svg.hashsalt": "mine"}):
        assert map_report(result, outcome(result, *FINDINGS)) == page
        assert mpl.rcParams["lines.linewidth"] == 9.0
        assert mpl.rcParams["svg.hashsalt"] == "mine"


def test_is_quick(result: MapResult) -> None:
    start = time.process_time()
    map_report(result, outcome(result))
    assert time.process_time() - start < 1.2


def test_shows_the_findings_and_says_that_nothing_was_left_out_only_without_any(result: MapResult, page: str) -> None:
    assert "cut after &lt;message&gt; 7." in page
    assert "skipped: 3 NEFF." in page
    assert page.index("recording-cut") < page.index("records-skipped")
    assert "nothing was skipped" not in page
    assert "nothing was skipped or assumed" in map_report(result, outcome(result))


def test_says_why_closures_were_rejected(result: MapResult, page: str) -> None:
    reasons = {closure.reason for closure in result.closures if not closure.accepted}
    assert reasons
    assert all(reason.replace("<", "&lt;") in page for reason in reasons)


def _nothing(poses: int) -> MapResult:
    """Return what an interrupted run may leave."""
    none = np.empty((0, 3))
    graph = PoseGraph(
        np.zeros(poses), np.zeros((poses, 3)), np.zeros((poses, 3, 3)), np.empty((0, 2), dtype=np.int64),
        none, np.empty((0, 3, 3)), (), np.empty(0),
    )  # fmt: skip
    counts = np.empty(0, dtype=np.int64)
    cells = np.empty((0, 16), dtype=np.uint8)
    landmarks = Landmarks(
        np.empty(0, dtype=np.str_), np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0), cells, counts, counts
    )
    grid = OccupancyGrid(0.05, (0.0, 0.0), np.full((3, 4), -1, dtype=np.int8))
    odometry = np.full((poses, 3), np.nan)
    still = np.zeros((poses, 3))
    return MapResult(graph, np.zeros(poses), still, odometry, still, (), grid, landmarks, (), {})


@pytest.mark.parametrize("poses", [1, 2])
def test_a_map_of_almost_nothing_has_a_page(poses: int) -> None:
    result = _nothing(poses)
    page = map_report(result, outcome(result, record={"groma": "0.0", "settings": {}}))
    assert _Balance(page).open == []
    assert "No loop was closed" in page
    assert "nan" not in re.sub(r"base64,[^\"]*", "", page).lower()


def test_thinned_keeps_ends_and_form() -> None:
    line = np.column_stack([np.linspace(0, 10, 1001), np.zeros(1001)])
    kept = thinned(np.vstack([line, [[np.nan, 0.0]]]), 1.0)
    assert kept[[0, -1], 0].tolist() == [0, 10]
    assert 10 <= len(kept) <= 12


def test_shrunk_keeps_walls() -> None:
    cells = np.array([[-1, 0, 100], [-1, -1, 0], [0, 0, -1]], dtype=np.int8)
    assert shrunk(cells, 2).tolist() == [[0, 100], [0, -1]]


def _closure(residual_m: float, residual_rad: float = 0.0, accepted: bool = True) -> Closure:
    return Closure(0.0, 1.0, (0.0, 0.0), (1.0, -2.0), accepted, "", 0.8, 1.0, residual_m, residual_rad)


def test_verdict_tells_consistent_strained_and_open_maps_apart(result: MapResult) -> None:
    def verdict(*closures: Closure, findings: tuple[Finding, ...] = ()) -> str:
        return map_words.verdict(dataclasses.replace(result, closures=closures, findings=findings, weak=()))

    assert verdict().startswith("No loop was closed")
    assert verdict(_closure(5.0, accepted=False)).startswith("No loop was closed")
    assert verdict(_closure(0.03)) == (
        "The map is consistent: 1 loop closure agrees with it to 3.0\N{NO-BREAK SPACE}cm, and no stretch of the drive "
        "is weakly constrained."
    )
    values = {"worst": (0.5, "m"), "worst_turn": (-0.03, "rad")}
    strained = Finding("closure-violated", "of 2 loop closures 1 cannot be met", place=(1.0, -2.0), values=values)
    assert verdict(_closure(0.03), findings=(strained,)).startswith(
        "The map is strained: of 2 loop closures 1 cannot be met, the worst by 50\N{NO-BREAK SPACE}cm and 1.72° near "
        "(1.0,\N{NO-BREAK SPACE}\N{MINUS SIGN}2.0), where walls may be doubled"
    )
    torn = Finding("map-torn", "the scan was not found on the map")
    assert verdict(_closure(0.03), findings=(strained, torn, torn)).startswith(
        "The map may be torn: 2 times tracking was lost"
    )
    assert "few returns & <glass>" in map_words.verdict(result)


@pytest.mark.parametrize(
    ("metres", "text"),
    [(0.0, "0.0 mm"), (0.00123, "1.2 mm"), (0.00999, "1.0 cm"), (0.034, "3.4 cm"), (0.34, "34 cm"), (0.999, "0.999 m"),
     (12.345, "12.3 m"), (293.2, "293 m"), (12345.6, "12346 m"), (-0.05, "−5.0 cm"), (float("nan"), "–"),
     (1.3e-15, "0.0 mm"), (-1e-9, "0.0 mm"), (2e-6, "0.0020 mm")],
)  # fmt: skip
def test_lengths(metres: float, text: str) -> None:
    assert words.length(metres) == text.replace(" ", "\N{NO-BREAK SPACE}")


def test_other_words() -> None:
    assert words.duration(59.6) == "1:00"
    assert words.duration(3725) == "1:02:05"
    assert words.number(-0.04, 1) == "0.0"
    assert (words.short(-1e-17), words.short(0.0123), words.pixels(3e-14)) == ("0", "0.012", "0\N{NO-BREAK SPACE}px")
    assert words.bearing(-np.pi / 2) == "90°"


def test_figures_are_those_of_the_result(result: MapResult) -> None:
    figures = map_figures(result)
    tracked = np.linalg.norm(result.tracked[:, :2] - result.trajectory[:, :2], axis=1)
    worst = np.sqrt(np.linalg.eigvalsh(result.graph.covariances[:, :2, :2])[:, -1].max())
    assert figures["drift_tracked_max_m"] == pytest.approx(tracked.max())
    assert figures["sigma_position_max_m"] == pytest.approx(worst)
    accepted = sum(closure.accepted for closure in result.closures)
    assert (figures["closures_accepted"], figures["closures_rejected"]) == (accepted, len(result.closures) - accepted)
    chi = figures["chi_square_per_dof"]
    assert isinstance(chi, dict)
    freedom = 3 * (len(result.graph.pairs) - len(result.graph.poses) + 1)
    assert chi["graph"] == pytest.approx(result.graph.chi_squares.sum() / freedom)

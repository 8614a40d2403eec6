"""The documents: every command line runs, every link leads somewhere, the page of the commands is that of the help.

Recordings that the documents name are simulated, a minute each, into a folder of the test. A line that needs what
an earlier line of its page wrote finds it there, for the lines of a page run in order.
"""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import groma.cli
import groma.cli.simulate
from camera_scenes import poses, write_images
from groma.io.recording import write_recording
from groma.io.trajectory import write_tum
from groma.simulation.scenes import Scenario, Simulated, scenario, simulate, true_relations, write_relations
from groma.simulation.vehicle import Arcs, CalibrationDrive, Tricycle, calibration_scenario, simulate_calibration

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
KALIBR_TARGET = "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.08\ntagSpacing: 0.3\n"
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def blocks(page: Path, language: str) -> list[str]:
    return [text for kind, text in BLOCK.findall(page.read_text("utf-8")) if kind == language]


def lines(page: Path) -> list[str]:
    """The command lines of groma on a page, in order."""
    return [line for block in blocks(page, "sh") for line in block.splitlines() if line.startswith("groma ")]


NOT_RUN = (
    "groma calibrate camera drive.mp4 ",
    "groma cameras map survey",
    "groma cameras node ",
    "groma cameras survey ",
    "groma demo",
    "groma evaluate motions ",
    "groma localize day2.mcap ",
    "groma map drive.mcap --landmarks ",
    "groma plan camera building/",
    "groma plan camera results/",
    "groma promote ",
    "groma simulate localization ",
)
"""Beginnings of lines that are only parsed: they wait for others, take minutes, or need what other tests make."""

WITH_LINES = [page for page in PAGES if lines(page)]


def first_minute(full: Scenario) -> Simulated:
    """The beginning of a drive, with a scan every 0.4 s at most."""
    scanner = msgspec.structs.replace(full.scanner, period=max(full.scanner.period, 0.4))
    drive = simulate(msgspec.structs.replace(full, scanner=scanner))
    steps, scans = drive.stamps < full.start + 60, drive.scan_stamps < full.start + 60
    by_step = {key: getattr(drive, key)[steps] for key in ("stamps", "truth", "odometry", "joints")}
    by_scan = {key: getattr(drive, key)[scans] for key in ("scan_stamps", "scan_truth", "ranges", "intensities")}
    return replace(drive, **by_step, **by_scan)


def there_and_back(drive: Simulated) -> Simulated:
    """The same drive, then its film backwards: every place is seen again."""
    names = ("truth", "odometry", "joints", "scan_truth", "ranges", "intensities")
    films: dict[str, Any] = {key: np.concatenate([film := getattr(drive, key), film[::-1]]) for key in names}
    end = 2 * drive.stamps[-1] + 1
    times: dict[str, Any] = {
        key: np.concatenate([t := getattr(drive, key), end - t[::-1]]) for key in ("stamps", "scan_stamps")
    }
    return replace(drive, **films, **times)


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings and truths under the names that the documents use."""
    folder = tmp_path_factory.mktemp("library")
    drive = first_minute(scenario("rooms"))
    write_recording(folder / "drive.mcap", drive)
    write_recording(folder / "agv.mcap", _eight_arcs())
    write_recording(folder / "return.mcap", there_and_back(drive))
    write_recording(folder / "drive.csv.gz", drive)
    (folder / "drive.csv.gz").rename(folder / "intel.clf.gz")  # the content decides, not the suffix
    write_tum(folder / "truth.tum", drive.stamps, drive.truth)
    write_relations(folder / "intel.relations", true_relations(drive.scan_stamps, drive.scan_truth))
    write_images(folder / "images", poses(12, seed=1))
    (folder / "april_6x6.yaml").write_text(KALIBR_TARGET)
    shutil.copytree(_mapped(folder), folder / "results" / "latest")
    return folder


def _eight_arcs() -> CalibrationDrive:
    """A tricycle on arcs, with few scans."""
    full = calibration_scenario(Tricycle())
    assert isinstance(full.program, Arcs)
    scanner = msgspec.structs.replace(full.scanner, period=0.4)
    program = msgspec.structs.replace(full.program, angles=2)
    return simulate_calibration(msgspec.structs.replace(full, scanner=scanner, program=program))


def _mapped(folder: Path) -> Path:
    assert groma.cli.run(["map", str(folder / "drive.mcap"), "-o", str(folder / "first")]) == 0
    return folder / "first"


@pytest.fixture
def folder(library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fresh copy of the library, as the current folder, where simulations are short."""
    shutil.copytree(library, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(groma.cli.simulate, "run", first_minute)
    return tmp_path


def test_the_pages_hold_command_lines() -> None:
    assert {name(page) for page in WITH_LINES} >= {
        "README.md",
        "docs/tour.md",
        "docs/how-to.md",
        "docs/reference/cli.md",
    }


@pytest.mark.parametrize("page", WITH_LINES, ids=name)
@pytest.mark.usefixtures("folder")
def test_every_command_line_runs(page: Path) -> None:
    for line in lines(page):
        words = shlex.split(line)[1:]
        groma.cli.app.parse_args(words, exit_on_error=False, print_error=False)
        if not line.startswith(NOT_RUN):
            assert groma.cli.run(words) == 0, line


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=name)
@pytest.mark.usefixtures("folder")
def test_examples_in_python_run_or_at_least_compile(page: Path) -> None:
    for block in blocks(page, "python"):
        program = compile(block, name(page), "exec")
        if block.startswith("from groma"):
            exec(program, {})  # noqa: S102 (our own documents)


def test_commands_named_in_passing_exist() -> None:
    known = {verb for verb in groma.cli.app if not verb.startswith("-")}
    for page in PAGES:
        for verb in re.findall(r"`groma ([a-z]+)", BLOCK.sub("", page.read_text("utf-8"))):
            assert verb in known, f"{name(page)}: groma {verb}"


def test_targets_named_in_the_documents_are_in_the_makefile() -> None:
    there = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    for page in PAGES:
        for target in re.findall(r"`?make ([a-z-]+)`", page.read_text("utf-8")):
            assert target in there, f"{name(page)}: make {target}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in LINK.findall(BLOCK.sub("", page.read_text("utf-8"))):
        if target.startswith(("https://", "http://")):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.is_relative_to(ROOT), f"{name(page)} leads out of the project: {target}"
        assert file.exists(), f"{name(page)}: {target}"
        assert not anchor or anchor in anchors(file), f"{name(page)}: {target}"


def anchors(page: Path) -> set[str]:
    """The headings of a page as a browser finds them."""
    text = BLOCK.sub("", page.read_text("utf-8"))
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_page_of_the_commands_is_that_of_the_help() -> None:
    page = runpy.run_path(str(ROOT / "scripts" / "cli_page.py"))
    assert page["PAGE"].read_text("utf-8") == page["page"](), "run make docs"


def test_the_page_of_the_findings_is_that_of_the_catalogue() -> None:
    page = runpy.run_path(str(ROOT / "scripts" / "findings_page.py"))
    assert page["PAGE"].read_text("utf-8") == page["page"](), "run make docs"

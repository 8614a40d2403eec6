"""`groma demo`: what it says, what it leaves, and that it is the other commands in a row."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

import pytest

import groma.cli
import groma.cli.demo
import groma.cli.simulate
from drives import scene
from groma.cli.demo import CHAPTERS, SEED
from groma.cli.demo_cameras import map_simulated_cameras
from groma.cli.demo_localization import localize_simulated
from groma.runs.run import Run
from groma.simulation.scenes import Scenario

LEFT = {
    "graph.g2o",
    "landmarks.json",
    "map.pgm",
    "map.yaml",
    "metrics.json",
    "report.html",
    "run.toml",
    "trajectory.tum",
}
SIMULATED = {"warehouse.mcap", "warehouse-truth.tum", "warehouse.relations"}


@pytest.fixture(autouse=True)
def few_scans(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same drive with fewer scans, so that it takes seconds."""

    def fewer(name: str, seed: int) -> Scenario:
        return scene(name, seed, period=1.0)

    monkeypatch.setattr(groma.cli.simulate, "scenario", fewer)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


def few_chapters(monkeypatch: pytest.MonkeyPatch) -> None:
    """The chapter that maps, alone."""
    monkeypatch.setattr(groma.cli.demo, "CHAPTERS", [c for c in CHAPTERS if c.folder == "map"])


@pytest.fixture
def told(out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """The lines of a run; only findings go to standard error when it is no terminal."""
    few_chapters(monkeypatch)
    assert groma.cli.run(["demo", "-o", str(out)]) == 0
    text, error = capsys.readouterr()
    assert all(line.startswith(("info: ", "warning: ")) for line in error.splitlines())
    return text.splitlines()


def test_a_chapter_says_what_was_typed_what_came_out_and_how_far_it_is_from_the_truth(
    out: Path, told: list[str]
) -> None:
    assert told[0] == "Map a building (groma map FILE)"
    verdict, accuracy, _, page, after = told[-5:]
    assert verdict.startswith("  The map is consistent: ")
    assert page == str(out / "report.html")
    assert "groma inspect FILE" in after
    found = re.search(r"error of (\d+) relative poses against the ground truth: ([\d.]+) m and ([\d.]+) deg", accuracy)
    assert found
    assert int(found[1]) > 100
    assert float(found[2]) < 0.02
    assert float(found[3]) < 0.1


def test_the_first_page_leads_to_the_report_of_each_chapter(out: Path, told: list[str]) -> None:
    content = (out / "report.html").read_text()
    assert escape(told[-5].strip()) in content
    links = re.findall(r'href="([^"]*)"', content)
    assert links == ["map/report.html"]
    assert all((out / link).is_file() for link in links)


def test_the_accuracy_is_that_of_groma_evaluate(out: Path, told: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    names = [str(out / "map" / "trajectory.tum"), "--relations", str(out / "recordings" / "warehouse.relations")]
    assert groma.cli.run(["evaluate", "trajectory", *names]) == 0
    error = re.search(r"translation error +([\d.]+) ", capsys.readouterr().out)
    assert error
    assert f"truth: {error[1]} m and" in told[-4]


@pytest.mark.usefixtures("told")
def test_groma_map_makes_the_same_of_its_recording(
    out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = out / "map"
    assert {path.name for path in folder.iterdir()} == LEFT
    assert {path.name for path in (out / "recordings").iterdir()} == SIMULATED
    monkeypatch.chdir(out.parent)
    recording = str(out / "recordings" / "warehouse.mcap")
    assert groma.cli.run(["map", recording, "-o", "again"]) == 0
    for name in sorted(LEFT - {"run.toml", "report.html"}):  # these two say by which command they were made
        assert (out.parent / "again" / name).read_bytes() == (folder / name).read_bytes(), name
    assert "report.html" in capsys.readouterr().out


def test_without_a_folder_latest_points_to_a_new_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few_chapters(monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert groma.cli.run(["demo"]) == 0
    assert {path.name for path in (tmp_path / "results/latest").iterdir()} == {
        "map",
        "metrics.json",
        "recordings",
        "report.html",
        "run.toml",
    }


def test_cameras_are_a_tenth_of_a_metre_off_at_most(tmp_path: Path) -> None:
    with Run("evaluation", "demo", tmp_path / "demo", command="") as run:
        _, (_, accuracy) = map_simulated_cameras(run, tmp_path, SEED)
        run.finish({})
    found = re.search(r"cameras (\d+) mm at most, where odometry alone ends ([\d.]+) m off", accuracy)
    assert found
    assert int(found[1]) <= 100
    assert float(found[2]) > 0.5
    assert (tmp_path / "demo" / "cameras" / "report.html").is_file()


@pytest.mark.slow
def test_the_depot_is_found_again_to_a_centimetre(tmp_path: Path) -> None:
    with Run("evaluation", "demo", tmp_path / "demo", command="") as run:
        _, (_, accuracy) = localize_simulated(run, tmp_path, SEED)
        run.finish({})
    found = re.search(r"truth: (\d+) mm in the median, (\d+) mm at most", accuracy)
    assert found
    assert int(found[1]) <= 10
    assert int(found[2]) <= 30
    assert (tmp_path / "demo" / "localization" / "report.html").is_file()

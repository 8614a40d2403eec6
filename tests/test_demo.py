"""`groma demo`: what it says, what it leaves, and that it is the other commands in a row."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import groma.cli
import groma.cli.simulate
from drives import scene
from groma.simulation import Scenario

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


@pytest.fixture
def told(out: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """The lines of a run; nothing goes to standard error when it is no terminal."""
    assert groma.cli.run(["demo", "-o", str(out)]) == 0
    text, error = capsys.readouterr()
    assert not error
    return text.splitlines()


def test_it_ends_with_verdict_accuracy_and_what_to_do_next(out: Path, told: list[str]) -> None:
    assert len(told) <= 12
    verdict, accuracy, after = told[-3:]
    assert verdict.startswith("The map is consistent: ")
    assert after == f"look at {out / 'report.html'}; then, for a recording of your own: groma map FILE"
    found = re.search(r"truth: ([\d.]+) m and ([\d.]+) deg in the mean of (\d+) true", accuracy)
    assert found
    assert float(found[1]) < 0.02
    assert float(found[2]) < 0.1
    assert int(found[3]) > 100


def test_it_says_first_what_is_in_the_recording(out: Path, told: list[str]) -> None:
    assert told[0].startswith(f"{out / 'warehouse.mcap'}: 521 scans, ")
    assert told[1].startswith(f"{out / 'warehouse.mcap'}: MCAP, ")
    assert "521 laser scan on /scan" in told[2]
    assert "  odometry from /odom" in told


def test_the_accuracy_is_that_of_groma_evaluate(out: Path, told: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    names = [str(out / "trajectory.tum"), "--relations", str(out / "warehouse.relations")]
    assert groma.cli.run(["evaluate", "trajectory", *names]) == 0
    error = re.search(r"translation error +([\d.]+) ", capsys.readouterr().out)
    assert error
    assert f"truth: {error[1]} m and" in told[-2]


@pytest.mark.usefixtures("told")
def test_groma_map_makes_the_same_of_its_recording(
    out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert {path.name for path in out.iterdir()} == LEFT | SIMULATED
    monkeypatch.chdir(out)
    monkeypatch.setattr("sys.argv", ["groma", "map", "warehouse.mcap", "-o", "again"])
    assert groma.cli.run(["map", "warehouse.mcap", "-o", "again"]) == 0
    for name in sorted(LEFT):
        assert (out / "again" / name).read_bytes() == (out / name).read_bytes(), name
    assert "report.html" in capsys.readouterr().out


def test_without_a_folder_latest_points_to_a_new_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert groma.cli.run(["demo"]) == 0
    assert {path.name for path in (tmp_path / "results/latest").iterdir()} == LEFT | SIMULATED

"""`groma evaluate motions`: drives and held panels tried out."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import groma.evaluation.motions as motions
from groma.cli import run as command
from groma.errors import UserError
from groma.planning.camera import Sitting, study_sitting


def test_the_drives_are_tried_out_and_two_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motions, "STUDY", {"views": (6, 10), "grid": (3,)})
    line = ["evaluate", "motions", "--runs", "2", "--views", "14", "--errors", "-o", str(tmp_path)]
    assert command(line) == 0
    told = capsys.readouterr().out
    assert told.count("refused: the panel faces the same way") == 2
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    refused = {motion for motion, found in metrics["motions"].items() if found["refused"] == 2}
    assert refused == {"stationary", "one-panel"}
    assert metrics["motions"]["square"]["predicted"][0] > 0
    assert [(point["varied"], point["value"]) for point in metrics["errors"]] == [
        ("views", 6),
        ("views", 10),
        ("grid", 3),
    ]
    page = (tmp_path / "report.html").read_text()
    assert page.count("<svg") == 2
    assert "nan" not in page.replace("nance", "")


def test_a_sitting_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(UserError, match="coverage = 0"):
        study_sitting(Sitting(10, 0.5, 1.0, 6, 0.0))


@pytest.mark.parametrize(("count", "band"), [(5, (0.624, 2.453)), (20, (0.765, 1.444)), (100, (0.878, 1.161))], ids=str)
def test_the_band_is_that_of_chi_square(count: int, band: tuple[float, float]) -> None:
    assert motions.rms_band(count) == pytest.approx(band, rel=0.025)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--runs", "1"], "--runs 1"),
        (["--views", "2"], "--views 2"),
        (["--seed", "-1"], "--seed -1"),
        (["--distance", "0"], "--distance 0"),
        (["--height", "-2"], "height = -2"),
    ],
)
def test_an_impossible_request_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    assert command(["evaluate", "motions", *arguments, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1

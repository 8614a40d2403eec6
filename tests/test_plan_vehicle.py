"""`groma plan vehicle`: plans, their files, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from groma.cli import run
from groma.planning.vehicle import plan_vehicle, thesis_grid

VEHICLE = {
    "drive_scale": 0.25e-3,
    "wheelbase": 1.5,
    "steering_gain": 1.0,
    "laser_x": 0.39,
    "laser_y": 0.0,
    "laser_yaw": 0.0,
}
TOLERANCE = "laser_x=1mm,laser_y=1mm,drive_scale=0.02%"


def plan(*arguments: str, output: Path) -> int:
    return run(["plan", "vehicle", "--wheelbase", "1.5", "--tolerance", TOLERANCE, *arguments, "-o", str(output)])


def test_a_plan_holds_its_tolerances_and_is_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    room = ["--floor", "0,0 10,0 10,7 0,7", "--footprint", "1.8,0.4,0.5"]
    assert plan(*room, "--path-max", "4", output=tmp_path / "out") == 0
    shown = capsys.readouterr().out
    rows = np.loadtxt(tmp_path / "out/plan.csv", delimiter=",", skiprows=1)
    assert f"{len(rows)} arcs, " in shown
    assert "no plan of such arcs takes less than" in shown
    assert np.abs(rows[:, 1]).max() <= 4.0 + 1e-9
    assert (rows[:, 4:6] > 0.0).all()
    assert (tmp_path / "out/plan.png").read_bytes()[:4] == b"\x89PNG"


def test_a_plan_takes_no_longer_than_a_grid() -> None:
    sigmas = {"steering_offset": 3e-4, "drive_scale": 5e-8, "laser_x": 5e-4, "laser_y": 5e-4, "laser_yaw": 2e-4}
    found = plan_vehicle("tricycle", VEHICLE, sigmas)
    assert all(found.sigmas[name] <= wanted for name, wanted in sigmas.items())
    for turn in (2.0, 3.14):
        grid, times = thesis_grid("tricycle", VEHICLE, sigmas, 4, turn)
        assert len(grid.path) == 16
        assert found.bound <= times * grid.time
    np.testing.assert_allclose(np.abs(grid.turn), 3.14)


def test_the_grid_of_the_thesis_is_laid_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert plan("--nseg", "6", "--beta-max", "180", output=tmp_path / "out") == 0
    assert "24 arcs, " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        (["--floor", "0,0 1,0"], "the floor must have three corners", 2),
        (["--floor", "0,0 1,0 x,1"], "--floor, corner 3 'x,1': must be 2 numbers", 2),
        (["--floor", "0,0 1,0 1,1", "--footprint", "2,2,2"], "no arc fits on the floor", 1),
        (["--footprint", "1"], "--footprint '1': must be 3 numbers", 2),
        (["--path-max", "-1"], "limit path max: must be above 0", 2),
        (["--alpha-max", "5"], "--alpha-max must not be below --alpha-min", 2),
        (["--free", "axle"], "axle cannot be free in the model tricycle", 2),
    ],
)
def test_bad_requests_are_one_line(
    arguments: list[str], message: str, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert plan(*arguments, output=tmp_path / "out") == code
    shown = capsys.readouterr().err
    assert message in shown
    assert shown.count("\n") == 1


def test_a_vehicle_is_needed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", "vehicle", "--tolerance", TOLERANCE]) == 2
    assert "--vehicle FILE, or --wheelbase METRES" in capsys.readouterr().err

"""Whatever ends a run, at whichever file: all of the old run is left or all of the new one, and the next run sweeps."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from drives import drive, scene
from groma.io.recording import write_recording
from groma.simulation.vehicle import Arcs, Tricycle, calibration_scenario, simulate_calibration

SCRIPT = Path(__file__).with_name("killed.py")
LEAST_CASES = 60
"""A run with a few files has so many file operations at least, fresh and used."""


def wrongs(folder: Path, how: str, *command: str) -> tuple[int, str]:
    """Return the number of cases, and what was wrong in them."""
    done = subprocess.run([sys.executable, SCRIPT, folder, how, *command], capture_output=True, text=True, timeout=600)
    *wrong, last = done.stdout.splitlines() or [""]
    assert last.endswith(" cases"), done.stderr
    return int(last.split()[0]), "\n".join(wrong)


@pytest.mark.parametrize(
    "how",
    [
        "kill",
        "full",
        "terminate",
        pytest.param("interrupt", marks=pytest.mark.slow),
        pytest.param("twice", marks=pytest.mark.slow),
        pytest.param("kill-link", marks=pytest.mark.slow),
        pytest.param("full-link", marks=pytest.mark.slow),
    ],
)
def test_at_every_file_operation_the_folder_is_the_old_or_the_new_one(how: str, tmp_path: Path) -> None:
    cases, wrong = wrongs(tmp_path, how)
    assert cases >= LEAST_CASES
    assert not wrong


@pytest.mark.slow
@pytest.mark.parametrize("how", ["kill", "full", "terminate"])
def test_a_map_is_the_old_or_the_new_one(how: str, tmp_path: Path) -> None:
    recording = drive(scene("rooms", period=1.0), 10.0).write(tmp_path / "drive.mcap")
    assert wrongs(tmp_path, how, "map", str(recording))[1] == ""


@pytest.mark.slow
@pytest.mark.parametrize("how", ["kill", "full"])
def test_a_calibration_is_the_old_or_the_new_one(how: str, tmp_path: Path) -> None:
    scenario = calibration_scenario(Tricycle(), 1)
    assert isinstance(scenario.program, Arcs)
    program = msgspec.structs.replace(scenario.program, angles=1)
    scanner = msgspec.structs.replace(scenario.scanner, period=0.2)
    write_recording(
        tmp_path / "agv.mcap",
        simulate_calibration(msgspec.structs.replace(scenario, program=program, scanner=scanner)),
    )
    assert wrongs(tmp_path, how, "calibrate", "vehicle", str(tmp_path / "agv.mcap"), "--wheelbase", "1.5")[1] == ""

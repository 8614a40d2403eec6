"""What readers find is told alike on standard error, in the report and in metrics.json, by every command that reads."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

import groma.cli
from drives import drive, scene
from findings_shown import findings_shown
from groma.io.csv_log import write
from groma.nouns.messages import Transform

COMMANDS = (
    "map {file} --resolution 0.2",
    "map {file} --landmarks {path}",
    "localize {file} --mode dynamic",
    "calibrate vehicle {file} --model differential",
    "evaluate features {file} --every 2",
    "evaluate loops {file}",
)
EXPECTED = {"recording-cut", "mount-unknown", "records-skipped", "records-malformed"}
"""The calibration of a vehicle finds where the laser sits itself, so the mounting is not requested there."""


@pytest.fixture(scope="module")
def spoiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A gzipped log without a mounting, with a line of another tool and a malformed one, cut near its end."""
    folder = tmp_path_factory.mktemp("spoiled")
    plain, path = folder / "plain.csv", folder / "drive.csv.gz"
    write(plain, (m for m in drive(scene("rooms", period=0.4), 30.0).messages if not isinstance(m, Transform)))

    head, *rest = plain.read_text().splitlines()
    text = "\n".join([head, "IMU,0.1,imu,1,2,3", "SCAN,100.0,scan,laser,541,here", *rest]) + "\n"
    path.write_bytes(gzip.compress(text.encode())[: -len(text) // 40])
    return path


@pytest.fixture(scope="module")
def path(spoiled: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Poses of the drive that are known."""
    out = tmp_path_factory.mktemp("path") / "map"
    groma.cli.run(["map", str(spoiled), "--resolution", "0.2", "-o", str(out)])
    return out / "trajectory.tum"


@pytest.mark.parametrize("command", COMMANDS)
def test_the_same_list_everywhere(
    command: str, spoiled: Path, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    capsys.readouterr()
    groma.cli.run([*command.format(file=spoiled, path=path).split(), "-o", str(out)])
    lacking = EXPECTED - findings_shown(out, capsys.readouterr().err)
    assert lacking <= ({"mount-unknown"} if command.startswith("calibrate") else set())

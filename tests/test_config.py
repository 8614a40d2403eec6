"""`groma config` prints the settings of every command, and every command takes them back."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

import groma.cli
from drives import drive, scene
from groma import _core
from groma.io.toml import to_toml
from groma.runs.settings import chosen
from groma.runs.tables import tables

COMMANDS = Path(groma.cli.__file__).parent


@pytest.fixture
def printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    """What `groma config` prints, as a file."""
    assert groma.cli.run(["config"]) == 0
    path = tmp_path / "all.toml"
    path.write_text(capsys.readouterr().out)
    return path


def test_prints_the_defaults_of_the_core_as_toml(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    defaults = {"resolution": 0.05, "scan": {"range_max": 30.0, "deskew": True}}
    monkeypatch.setattr(_core, "map_defaults", lambda: json.dumps(defaults))
    assert groma.cli.run(["config"]) == 0
    read = tomllib.loads(capsys.readouterr().out)
    assert read["map"] == {"scans": "", "odometry": "", **defaults}
    assert read["cameras"] == json.loads(_core.network_defaults())


@pytest.mark.parametrize("table", tables())
def test_every_table_comes_back_as_it_was_printed(table: str, printed: Path) -> None:
    assert chosen(tables()[table](), printed, table, {}) == tables()[table]()


def test_a_command_asks_only_for_tables_that_are_printed() -> None:
    asked = {name for path in COMMANDS.glob("*.py") for name in re.findall(r"table \[(\w+)\]", path.read_text())}
    assert asked == set(tables())


def test_a_table_that_is_missing_is_told_with_where_to_get_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "other.toml").write_text("[other]\n")
    line = f"plan vehicle --wheelbase 1.5 --tolerance laser_x=1mm --config {tmp_path / 'other.toml'}"
    assert groma.cli.run(line.split()) == 2
    assert "has no table [plan_vehicle]: `groma config` prints one" in capsys.readouterr().err


LINES = {
    "plan_vehicle": (
        "plan vehicle --wheelbase 1.5 --tolerance laser_x=1mm,laser_y=1mm --path-max 3",
        "--wheelbase 1.5",
    ),
    "plan_camera": ("plan camera --height 2.4 --down 30 --sigma 2", "--height 2.4 --down 30"),
    "exploration": ("plan exploration --scene hexagons --size 5 --sigma 0.3 --seed 3", "--scene hexagons --size 5"),
    "motions": ("evaluate motions --runs 2 --views 6 --seed 4", ""),
    "map": ("map {drive} --resolution 0.2 --odometry none", "{drive}"),
    "localize": ("localize {drive} --mode dynamic", "{drive}"),
    "features": ("evaluate features {drive} --every 5", "{drive}"),
    "evaluate_exploration": ("evaluate exploration --scene hexagons --size 5 --lambdas 30", ""),
    "simulate_cameras": ("simulate cameras corridor --seed 3", "corridor"),
}
"""By table: a command line with options, and the rest of the line that settings do not say."""


@pytest.mark.parametrize("table", LINES)
def test_a_run_repeated_with_its_own_settings_has_the_same_settings(table: str, tmp_path: Path) -> None:
    recording = tmp_path / "drive.mcap"
    if "{drive}" in LINES[table][0]:
        drive(scene("rooms", period=0.4), 20.0).write(recording)
    whole, rest = (line.format(drive=recording).split() for line in LINES[table])
    verb = whole[: 2 if whole[0] in ("plan", "evaluate", "simulate") else 1]
    groma.cli.run([*whole, "-o", str(tmp_path / "first")])
    config = ["--config", str(tmp_path / "first" / "run.toml")]
    groma.cli.run([*verb, *rest, *config, "-o", str(tmp_path / "again")])
    first, again = (tomllib.loads((tmp_path / name / "run.toml").read_text()) for name in ("first", "again"))
    assert first["settings"][table]
    assert again["settings"] == first["settings"]
    metrics = [json.loads((tmp_path / name / "metrics.json").read_text()) for name in ("first", "again")]
    assert metrics[0]["verdict"] == metrics[1]["verdict"]


@pytest.mark.parametrize(
    ("verb", "table", "options"),
    [("simulate rooms", "simulate", "--seed 4"), ("simulate vehicle", "simulate_vehicle", "--arcs 4 --delay 0.01")],
)
def test_a_file_simulates_what_options_simulate(verb: str, table: str, options: str, tmp_path: Path) -> None:
    config = tmp_path / "settings.toml"
    pairs = options.replace("--", "").split()
    config.write_text("\n".join([f"[{table}]", *map(" = ".join, zip(pairs[::2], pairs[1::2], strict=True))]))
    for name, given in (("options", options), ("file", f"--config {config}"), ("plain", "")):
        assert groma.cli.run([*verb.split(), "-o", str(tmp_path / f"{name}.csv"), *given.split()]) == 0
    by_options, by_file, plain = ((tmp_path / f"{name}.csv").read_bytes() for name in ("options", "file", "plain"))
    assert by_options == by_file != plain


def test_a_trajectory_is_matched_as_a_file_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, first in (("estimate", 0.5), ("truth", 0.0)):
        lines = [f"{first + k} {first + k} 0 0 0 0 0 1" for k in range(5)]
        (tmp_path / f"{name}.tum").write_text("\n".join(lines) + "\n")
    line = f"evaluate trajectory {tmp_path / 'estimate.tum'} --reference {tmp_path / 'truth.tum'} --json"
    assert groma.cli.run(line.split()) == 2
    config = tmp_path / "settings.toml"
    config.write_text('[trajectory]\nassoc = "interp"\n')
    capsys.readouterr()
    assert groma.cli.run([*line.split(), "--config", str(config)]) == 0
    assert json.loads(capsys.readouterr().out)["ate_m"]["rmse"] < 1e-9
    assert groma.cli.run([*line.split(), "--config", str(config), "--assoc", "nearest"]) == 2


def test_a_value_of_another_form_is_refused_with_its_path(
    printed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(to_toml({"plan_camera": {"depth": "far"}}))
    assert groma.cli.run(["plan", "camera", "--config", str(wrong)]) == 2
    assert "plan_camera" in capsys.readouterr().err
    assert printed.exists()

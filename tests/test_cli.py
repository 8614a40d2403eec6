"""The command line as a whole: help with examples, exit codes, one line and no traceback for every mistake."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from cyclopts import App

import groma
import groma.cli
from drives import drive, scene

GROMA = Path(sys.executable).with_name("groma")
COMMANDS = [
    ["demo"],
    ["inspect"],
    ["map"],
    ["localize"],
    ["promote"],
    ["simulate"],
    ["simulate", "cameras"],
    ["simulate", "vehicle"],
    ["simulate", "localization"],
    ["config"],
    ["calibrate", "camera"],
    ["calibrate", "vehicle"],
    ["cameras", "map"],
    ["cameras", "node"],
    ["cameras", "survey"],
    ["plan", "camera"],
    ["plan", "exploration"],
    ["plan", "vehicle"],
    ["evaluate", "exploration"],
    ["evaluate", "trajectory"],
    ["evaluate", "features"],
    ["evaluate", "loops"],
    ["evaluate", "motions"],
]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten seconds."""
    return drive(scene("rooms", period=1.0), 10.0).write(tmp_path_factory.mktemp("cli") / "drive.mcap")


def commands(app: App) -> Iterator[list[str]]:
    """What can be run: verbs and the verbs below them."""
    for name in app:
        if not name.startswith("-"):
            verb = app[name]
            if verb.default_command is not None:
                yield [name]
            yield from ([name, *rest] for rest in commands(verb))


def test_the_list_of_commands_is_whole() -> None:
    assert sorted(commands(groma.cli.app)) == sorted(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_help_shows_an_example(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert groma.cli.run([*command, "--help"]) == 0
    told = capsys.readouterr().out
    assert "Usage: groma" in told
    examples = [line for line in told.splitlines() if line.startswith(" ".join(["groma", *command]))]
    assert examples or command == ["config"]


def test_without_a_command_it_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert groma.cli.run([]) == 0
    told = capsys.readouterr().out
    assert all(command[0] in told for command in COMMANDS)


def test_version() -> None:
    done = subprocess.run([GROMA, "--version"], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == groma.__version__


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["evaluate", "nonsense"],
        ["map"],
        ["map", "{recording}", "--bogus"],
        ["map", "{recording}", "--threads", "many"],
        ["map", "{recording}", "--resolution"],
        ["config", "more"],
        ["demo", "more"],
        ["simulate", "castle", "-o", "x.mcap"],
    ],
    ids=" ".join,
)
def test_what_it_does_not_understand_is_exit_2(
    arguments: list[str], recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert groma.cli.run([part.format(recording=recording) for part in arguments]) == 2
    assert "Error" in "".join(capsys.readouterr())


MISTAKES = {
    "map {folder}/none.mcap": "no such file",
    "inspect {folder}/none.mcap": "no such file",
    "evaluate trajectory {folder}/none.tum --reference {recording}": "none.tum",
    "evaluate trajectory {recording}": "--relations or --reference",
    "evaluate trajectory {recording} --reference {recording}": "drive.mcap",
    "map {folder}": "no ROS 2 bag",
    "map {text}": "not a recording",
    "map {empty}": "not a recording",
    "map {recording} -o {text}": "is a file",
    "map {recording} -o {text}/deeper": "choose another with -o",
    "map {recording} -o {folder}/x --scans /front": "/scan",
    "map {recording} -o {folder}/x --odometry /wheels": "/odom",
    "map {recording} -o {folder}/x --resolution 0": "resolution",
    "map {recording} -o {folder}/x --resolution=-1": "resolution",
    "map {recording} -o {folder}/x --resolution nan": "resolution",
    "map {recording} -o {folder}/x --threads 0": "--threads",
    "map {recording} -o {folder}/x --config {folder}/none.toml": "none.toml",
    "map {recording} -o {folder}/x --config {folder}": "cannot be read",
    "map {recording} -o {folder}/x --config {text}": "is not TOML",
    "map {recording} -o {folder}/x --config {empty}": "no table [map]",
    "map {recording} -o {folder}/x --vehicle {folder}/none.toml": "none.toml",
    "map {recording} -o {folder}/x --vehicle {text}": "is not TOML",
    "map {recording} -o {folder}/x --vehicle {text} --odometry /odom": "contradict",
    "demo -o {text}": "is a file",
    "simulate rooms -o {folder}/x.bag": ".mcap",
    "simulate rooms -o {folder}/none/x.mcap": "cannot be written",
    "simulate rooms -o {folder}/x.mcap --seed=-1": "--seed",
    "simulate vehicle -o {folder}/x.bag": ".mcap",
    "calibrate vehicle {folder}/none.mcap": "no such file",
    "calibrate vehicle {text}": "not a recording",
    "calibrate vehicle {recording} -o {text}": "is a file",
    "calibrate vehicle {recording} -o {folder}/x --model tricycle": "--joints",
    "calibrate vehicle {recording} -o {folder}/x --wheels /front": "/joint_states",
    "calibrate vehicle {recording} -o {folder}/x --joints a,b": "left_wheel_joint",
    "calibrate vehicle {recording} -o {folder}/x --scans /front": "/scan",
    "calibrate vehicle {recording} -o {folder}/x --poses /tracker": "/odom",
    "calibrate vehicle {recording} -o {folder}/x --window 0": "--window",
    "calibrate vehicle {recording} -o {folder}/x --axle nan": "axle",
    "calibrate vehicle {recording} -o {folder}/x --wheelbase 0": "--wheelbase",
    "calibrate vehicle {recording} -o {folder}/x --free mass": "--free mass",
    "calibrate vehicle {recording} -o {folder}/x --wheelbase 1 --free wheelbase": "contradict",
    "calibrate vehicle {recording} -o {folder}/x --tolerance laser_x": "name=number",
    "simulate vehicle -o {folder}/x.mcap --arcs 15": "multiple of 4",
    "simulate vehicle -o {folder}/x.mcap --duration nan": "--duration",
    "simulate vehicle -o {folder}/x.mcap --delay nan": "delay",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_one_line_and_exit_2(
    line: str, recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A traceback would be an exception here: `run` turns only what it knows into an exit code."""
    text, empty = tmp_path / "notes.txt", tmp_path / "empty"
    text.write_text("hello\nworld\n")
    empty.touch()
    places = {"folder": tmp_path, "recording": recording, "text": text, "empty": empty}
    assert groma.cli.run([part.format(**places) for part in line.split()]) == 2
    out, error = capsys.readouterr()
    assert not out
    assert len(error.splitlines()) == 1
    assert error.startswith("groma: ")
    assert MISTAKES[line] in error
    assert sorted(tmp_path.iterdir()) == [empty, text], "nothing is left behind"


def test_rerun_without_its_package_is_one_line_of_advice(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert groma.cli.run(["map", str(recording), "-o", str(tmp_path / "out"), "--rerun"]) == 2
    assert capsys.readouterr().err == "groma: --rerun needs rerun-sdk: pip install 'groma[rerun]'\n"
    assert not (tmp_path / "out").exists()


def test_the_process_has_the_exit_code(tmp_path: Path) -> None:
    done = subprocess.run([GROMA, "map", tmp_path / "none"], check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [f"groma: {tmp_path / 'none'}: no such file or folder"]

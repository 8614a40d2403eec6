"""Ctrl-C ends a command soon after its work has begun, and leaves nothing that looks like a result."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

SOON = 2.0
BUSY = 3.0
"""A machine with other work takes longer [s]."""
COMMANDS = {
    "plan exploration": ["plan", "exploration", "--scene", "sparse", "--size", "196", "--sigma", "0.1"],
    "evaluate exploration": ["evaluate", "exploration", "--size", "64"],
    "evaluate motions": ["evaluate", "motions", "--runs", "1000"],
    "simulate localization": ["simulate", "localization"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_ctrl_c_ends_a_command_soon(name: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-c", "from groma.cli import main; main()", *COMMANDS[name], "-o", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        while not list(tmp_path.glob(".out.groma-*")):  # made right before the work
            assert process.poll() is None, process.stderr and process.stderr.read()
            time.sleep(0.02)
        time.sleep(1.0)
        if process.poll() is not None:
            pytest.fail("it was done before it was interrupted: this shows nothing")
        os.kill(process.pid, signal.SIGINT)
        begun = time.monotonic()
        _, error = process.communicate(timeout=60)
    assert time.monotonic() - begun < SOON + BUSY
    assert b"Traceback" not in error
    assert process.returncode != 0
    assert not (out / "metrics.json").exists()


WHOLE = {
    "simulate cameras": (["simulate", "cameras", "hallway", "--images"], "*/images/*/*.png"),
    "simulate localization": (["simulate", "localization"], "*/path1-run1-truth.tum"),
}
"""Commands that keep what is finished, and a file that shows that something is."""


@pytest.mark.parametrize("name", WHOLE)
def test_what_is_finished_is_kept(name: str, tmp_path: Path) -> None:
    arguments, first = WHOLE[name]
    out = tmp_path / "out"
    command = [sys.executable, "-c", "from groma.cli import main; main()", *arguments, "-o", str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        while not list(tmp_path.glob(f".out.groma-{first}")):
            assert process.poll() is None, process.stderr and process.stderr.read()
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGINT)
        begun = time.monotonic()
        output, error = process.communicate(timeout=60)
    assert time.monotonic() - begun < SOON + BUSY
    assert process.returncode == 0, error
    assert b"interrupted" in error
    assert json.loads((out / "metrics.json").read_text())["verdict"] == "interrupted"
    names = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert names == set(tomllib.loads((out / "run.toml").read_text())["files"])
    recordings = list(out.glob("*.mcap"))
    assert all((out / f"{path.stem}-truth.tum").exists() for path in recordings)
    assert f"{len(recordings)} drives".encode() in output or name == "simulate cameras"

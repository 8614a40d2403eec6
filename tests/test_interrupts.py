"""Ctrl-C ends a command soon after its work has begun, and leaves nothing that looks like a result."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
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

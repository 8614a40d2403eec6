"""Memory does not grow with the recording: peak resident size of a process that reads a synthetic bag to its end."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from made import Entry, Ros, bag1, bag2
from rosbags.rosbag2 import StoragePlugin

READ = """
import resource, sys
from groma.recordings.drive import open_drive
from groma.io.recording import open_recording
drive = open_drive(open_recording(sys.argv[1]))
print(sum(1 for _ in drive.events()), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)
"""
BEAMS = 1081
SCAN_BYTES = 4 * BEAMS


def big_bag(path: Path, kind: str, megabytes: int) -> tuple[Path, int]:
    path.mkdir(exist_ok=True)
    ros = Ros(1 if kind == "bag" else 2)
    count = megabytes * 1_000_000 // SCAN_BYTES
    ranges = np.linspace(1.0, 20.0, BEAMS).tolist()

    def entries() -> Iterator[Entry]:
        for k in range(count):
            yield "/scan", 1.0 + 0.025 * k, ros.scan(1.0 + 0.025 * k, ranges)

    if kind == "bag":
        return bag1(path / "a.bag", entries()), count
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    return bag2(path / "a", entries(), plugin), count


def peak_megabytes(path: Path, count: int) -> int:
    done = subprocess.run([sys.executable, "-c", READ, str(path)], capture_output=True, text=True, check=True)
    read, peak = map(int, done.stdout.split())
    assert read == count
    return peak


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_a_bag_of_80_megabytes(tmp_path: Path, kind: str) -> None:
    small = peak_megabytes(*big_bag(tmp_path / "small", kind, 8))
    large = peak_megabytes(*big_bag(tmp_path / "large", kind, 80))
    assert large < small + 15


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_a_bag_of_a_gigabyte(tmp_path: Path, kind: str) -> None:
    path, count = big_bag(tmp_path, kind, 1000)
    try:
        assert peak_megabytes(path, count) < 400
    finally:
        for file in [path] if path.is_file() else list(path.iterdir()):
            file.unlink()

"""Examples: each runs by itself and prints the result that its head promises."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
# What the last line must look like, and the largest value that each number in it may have.
PROMISED = {
    "01": (r"consistent: (\d+) loop closures, largest error ([\d.]+) m", (10_000.0, 0.05)),
    "02": (r"pose known at 100% of the scans, largest error (\d+) mm", (40.0,)),
    "03": (r"([45]) of 5 intervals contain the truth", (5.0,)),
    "04": (r"fx 60\d\.\d+ \+- ([\d.]+) px from 8 images, error [+-]([\d.]+) px", (0.5, 1.0)),
    "05": (r"7 cameras located, largest error (\d+) mm; odometry alone ends ([\d.]+) m off", (150.0, 10.0)),
    "06": (r"weight +1000: +\d+ m find 16 cameras, predicted ([\d.]+) m \(1 sigma\), tried out ([\d.]+) m", (0.3, 0.3)),
    "07": (r"[4-9] corners matched, error (\d+) mm and ([\d.]+) deg", (20.0, 0.5)),
}


def test_examples_are_numbered_without_a_gap() -> None:
    assert [path.name[:2] for path in sorted(EXAMPLES.glob("*.py"))] == sorted(PROMISED)


@pytest.mark.parametrize("number", PROMISED)
def test_an_example_prints_what_it_promises(number: str, tmp_path: Path) -> None:
    (path,) = EXAMPLES.glob(f"{number}_*.py")
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    pattern, most = PROMISED[number]
    found = re.fullmatch(pattern, done.stdout.splitlines()[-1])
    assert found, done.stdout
    assert all(float(value) <= bound for value, bound in zip(found.groups(), most, strict=True)), done.stdout
    assert not list(tmp_path.iterdir())


def test_an_example_is_one_screen() -> None:
    assert all(len(path.read_text().splitlines()) <= 45 for path in EXAMPLES.glob("*.py"))

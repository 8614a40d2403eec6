from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.evaluation.mrclam import Noise, calibrated, localize, read_mrclam

HEAD = "# a comment\n"


def _write(folder: Path) -> Path:
    """Write a robot that drives straight at 0.1 m/s, past four marks."""
    marks = [(6, 2.0, 1.0), (7, 4.0, -1.5), (8, 7.0, 1.2), (9, 9.0, -1.0)]
    stamps = np.arange(0.0, 60.0, 0.1)
    (folder / "Landmark_Groundtruth.dat").write_text(HEAD + "".join(f"{n} {x} {y} 1e-4 1e-4\n" for n, x, y in marks))
    (folder / "Barcodes.dat").write_text(HEAD + "".join(f"{n} {10 * n}\n" for n, *_ in marks) + "1 5\n")
    # The odometry says a tenth more than was driven.
    (folder / "Robot1_Odometry.dat").write_text("".join(f"{t:.3f} 0.11 0.0\n" for t in stamps))
    (folder / "Robot1_Groundtruth.dat").write_text("".join(f"{t:.3f} {0.1 * t:.6f} 0.0 0.0\n" for t in stamps))
    lines = [f"{t:.3f} 5 1.0 0.0\n" for t in stamps[::7]]  # another robot: left out
    for t in stamps[1::5]:
        for n, x, y in marks:
            d = np.array([x - 0.1 * t, y])
            if d[0] > 0.3:
                lines.append(f"{t:.3f} {10 * n} {np.hypot(*d):.6f} {np.arctan2(d[1], d[0]):.6f}\n")
    (folder / "Robot1_Measurement.dat").write_text("".join(lines))
    return folder


@pytest.mark.parametrize("known", [True, False])
def test_localizes_a_made_up_robot(tmp_path: Path, known: bool) -> None:
    data = read_mrclam(_write(tmp_path))
    (robot,) = data.robots
    noise = calibrated(data.robots)
    assert noise.speed_scale == pytest.approx(1 / 1.1, rel=1e-3)
    drive = localize(data, robot, noise, known=known)
    assert drive.rmse < 0.01
    assert drive.matched == drive.right == len(robot.landmark)


def test_names_what_is_missing_or_broken(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"Landmark_Groundtruth.dat: is missing"):
        read_mrclam(tmp_path)
    (_write(tmp_path) / "Robot1_Odometry.dat").write_text("0.0 0.1\n")
    with pytest.raises(UserError, match=r"Robot1_Odometry.dat:1: 2 columns, expected 3"):
        read_mrclam(tmp_path)


@pytest.mark.shared
def test_holds_the_bars_on_the_real_robots(shared: Path) -> None:
    data = read_mrclam(shared / "data/mrclam/MRCLAM_Dataset6")
    assert len(data.robots) == 5
    errors = [localize(data, robot, calibrated(data.robots), known=True).rmse for robot in data.robots]
    assert np.mean(errors) < 0.12
    assert max(errors) < 0.15


def test_the_noise_is_stated() -> None:
    assert Noise().range > Noise().along > 0

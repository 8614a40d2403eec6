"""Logs for calibration: encoder logs, motion tuples, the MINES rover; whole, damaged, and as the commands see them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from groma.io.recording import open_recording
from groma.nouns.messages import JointState, LaserScan, Odometry

ENCODER_HEAD = "#kinematic_model: traction_drive_wheel\n#joints_max_enc_values: 8192 5000\n"


def encoder_line(stamp: float, steering: int, traction: int, x: float) -> str:
    return f"time: {stamp:.9f} ticks: {steering} {traction} model_pose: 0 0 0 tracker_pose: {x} 0.5 0.1\n"


def test_an_encoder_log_is_read_and_its_counter_overflows(tmp_path: Path) -> None:
    file = tmp_path / "drive.txt"
    ticks = [4294967290, 4294967295, 4, 5004]
    lines = [encoder_line(10 + k, 8192 - 2048, tick, 0.1 * k) for k, tick in enumerate(ticks)]
    file.write_text(
        ENCODER_HEAD + "".join(lines) + "time: 1 ticks: 2\n" + encoder_line(9, 0, 0, 0).replace("ticks", "tacks")
    )
    opened = open_recording(file)
    messages = list(opened.messages())
    joints = [m for m in messages if isinstance(m, JointState)]
    turns = np.array([m.positions[0] for m in joints]) / (2 * np.pi) * 5000
    assert np.diff(turns) == pytest.approx([5, 5, 5000], rel=1e-6)
    assert joints[0].positions[1] == pytest.approx(-np.pi / 2), "an absolute encoder reads -pi .. pi"
    poses = [m.x for m in messages if isinstance(m, Odometry) and m.child_frame == "sensor"]
    assert poses == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert opened.notes.malformed == 2
    assert opened.notes.examples[0].startswith("drive.txt:7: expected time: t ticks:")


def test_wrong_counts_per_turn_are_told(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("#kinematic_model: x\n#joints_max_enc_values: 0 5000\n" + encoder_line(1, 2, 3, 0))
    opened = open_recording(tmp_path / "a")
    assert len(list(opened.messages())) == 3
    assert "counts per turn = 0" in opened.notes.examples[0]


def test_tuples_are_put_one_after_the_other(tmp_path: Path) -> None:
    one = {"T": 0.5, "phi_l": 1.0, "phi_r": 2.0, "sm": [0.1, 0.0, np.pi / 2]}
    good = json.dumps(one)
    (tmp_path / "a.tuple").write_text(f'{good}\n\n{good} {good}\n{{"T": 1, "phi_l": 0}}\n{{"T": -1\n')
    opened = open_recording(tmp_path / "a.tuple")
    messages = list(opened.messages())
    poses = np.array([(m.x, m.y, m.theta) for m in messages if isinstance(m, Odometry)])
    assert poses[:, :2] == pytest.approx(np.array([[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]), abs=1e-12)
    assert np.exp(1j * poses[:, 2]) == pytest.approx(np.array([1, 1j, -1, -1j]))
    wheels = [m.positions for m in messages if isinstance(m, JointState)]
    assert wheels[-1] == pytest.approx([1.5, 3.0])
    assert opened.notes.malformed == 2
    assert [m.stream for m in opened.messages({"wheels"})] == ["wheels"] * 4


def mines_line(stamp: int, left: int, right: int, readings: list[int]) -> str:
    columns = [stamp, 0, left, right, *[0] * 21, *readings]
    return " ".join(map(str, columns)) + "\n"


def test_the_rover_has_wheels_and_scans(tmp_path: Path) -> None:
    readings = [0, 7, 2000, *[1500] * 679]
    lines = [mines_line(1_000_000, 2**32 - 500, 10, readings), mines_line(1_100_000, 1500, 2010, readings)]
    (tmp_path / "a.dat").write_text(
        lines[0] + "1 2 3\n" + lines[1] + mines_line(1, 1, 1, readings).replace("1500", "x", 1)
    )
    opened = open_recording(tmp_path / "a.dat")
    messages = list(opened.messages())
    wheels = np.array([m.positions for m in messages if isinstance(m, JointState)])
    assert np.diff(wheels, axis=0)[0] == pytest.approx([2 * np.pi, 2 * np.pi])
    scan = next(m for m in messages if isinstance(m, LaserScan))
    assert np.isposinf(scan.ranges[0])
    assert np.isnan(scan.ranges[1])
    assert scan.ranges[2] == 2.0
    assert scan.stamp == 1.0
    assert opened.notes.malformed == 2
    assert "3 columns, expected 707" in opened.notes.examples[0]


@pytest.mark.shared
def test_shared_logs_are_read_whole(shared: Path) -> None:
    data = shared / "data"
    counts = {
        "calib-tricycle/dataset_first_half.txt.gz": (JointState, 1202),
        "calib-censi/lstraight.tuple.gz": (JointState, 4397),
        "mines-rover/exp1.dat.gz": (LaserScan, 756),
        "mines-rover/exp2.dat.gz": (LaserScan, 641),
    }
    for name, (kind, count) in counts.items():
        opened = open_recording(data / name)
        assert sum(isinstance(m, kind) for m in opened.messages()) == count, name
        assert not opened.notes.malformed, name

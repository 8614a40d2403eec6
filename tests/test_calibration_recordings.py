"""Calibration on recordings of others: a Khepera III of Censi et al., and a real tricycle."""

from __future__ import annotations

import dataclasses
import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from groma.vehicle.calibration import OdometryLog, SensorMotions, calibrate, closed_form

WINDOW = 0.5
"""Length of the motions of the tricycle [s]."""

pytestmark = pytest.mark.shared


def tuples(path: Path) -> tuple[OdometryLog, SensorMotions]:
    """Read a file of synchronised tuples of Censi et al."""
    # Two objects may share a line.
    with gzip.open(path, "rt") as stream:
        rows = [json.loads(part + "}") for part in stream.read().split("}")[:-1]]
    interval, speeds = np.array([row["T"] for row in rows]), np.array([[row["phi_l"], row["phi_r"]] for row in rows])
    time = np.concatenate([[0.0], np.cumsum(interval)])
    angles = np.vstack([np.zeros((1, 2)), np.cumsum(speeds * interval[:, None], axis=0)])
    motions = SensorMotions(time[:-1], time[1:], np.array([row["sm"] for row in rows]))
    return OdometryLog(time, angles), motions


def tricycle_log(path: Path) -> tuple[OdometryLog, SensorMotions]:
    """Read the log of a steering vehicle: absolute steering 8192, traction ticks that overflow, a tracked pose."""
    with gzip.open(path, "rt") as stream:
        rows = [line.split() for line in stream if line.startswith("time:")]
    table = np.array([[row[k] for k in (1, 3, 4, 10, 11, 12)] for row in rows], dtype=np.float64)
    time = table[:, 0] - table[0, 0]
    steering = np.unwrap(table[:, 1], period=8192.0) * (2.0 * np.pi / 8192.0)
    steering -= 2.0 * np.pi * np.round(np.median(steering) / (2.0 * np.pi))
    ticks = np.unwrap(table[:, 2], period=2.0**32) - table[0, 2]
    poses = np.column_stack([table[:, 3:5], np.unwrap(table[:, 5])])
    log = OdometryLog(time, ticks, steering)
    chosen = [0]
    for k in range(len(time)):
        if time[k] - time[chosen[-1]] >= WINDOW - 0.02:
            chosen.append(k)
    # The tracker's errors grow with the way: differences of its poses are independent, its poses are not.
    motions = SensorMotions.from_poses(time[chosen], poses[chosen], np.tile(np.eye(3), (len(chosen), 1, 1)))
    return log, dataclasses.replace(motions, covariance=None, coupling=None)


@pytest.mark.parametrize("name", ["lstraight", "lstraight_0", "lstraight_1", "lstraight_2"])
def test_closed_form_equals_the_published_solution_to_its_digits(shared: Path, name: str) -> None:
    log, motions = tuples(shared / f"data/calib-censi/{name}.tuple.gz")
    published = json.loads((shared / f"data/calib-censi/{name}_results.json").read_text())
    found = closed_form("differential", log, motions, rounds=4, share=0.01)
    assert found is not None
    p = found[0]
    ours = {
        "axle": p["axle"],
        "l_diam": 2.0 * p["left_radius"],
        "r_diam": 2.0 * p["right_radius"],
        "l_x": p["laser_x"],
        "l_y": p["laser_y"],
        "l_theta": p["laser_yaw"],
    }
    assert {key: f"{value:.6g}" for key, value in ours.items()} == {key: f"{published[key]:.6g}" for key in ours}


def test_the_likelihood_agrees_with_it_within_its_errors(shared: Path) -> None:
    log, motions = tuples(shared / "data/calib-censi/lstraight.tuple.gz")
    found = calibrate("auto", log, motions)
    assert found.model == "differential"
    published = [20.885e-3, 20.948e-3, 89.052e-3, -5.81e-3, 0.19e-3, np.radians(0.54)]
    np.testing.assert_array_less(np.abs(found.values - published), 3.0 * found.sigmas)
    assert found.held_out is not None
    assert found.held_out.position_median < 0.85e-3


def test_a_real_tricycle_is_predicted_to_eleven_millimetres(shared: Path) -> None:
    log, motions = tricycle_log(shared / "data/calib-tricycle/dataset_first_half.txt.gz")
    found = calibrate("auto", log, motions, free=("wheelbase", "gain", "delay"))
    assert found.model == "tricycle"  # It hardly turns backward here: an asymmetry must not be made up.
    assert any("drive arcs both ways" in note for note in found.notes)
    assert found.held_out is not None
    assert found.held_out.position_median <= 11e-3
    assert 1.50 < found.parameters["wheelbase"] < 1.56
    assert 0.53 < found.parameters["steering_gain"] < 0.57

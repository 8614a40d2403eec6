"""The values that calibration takes and gives."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from groma.errors import EstimationError
from groma.vehicle.calibration import OdometryLog, SensorMotions, calibrate, closed_form

Array = NDArray[np.float64]


def test_motions_of_poses_carry_the_scatter_of_their_draws() -> None:
    poses = np.array([[0.0, 0.0, 0.3], [1.0, 0.4, 1.5], [0.2, 1.9, 3.9], [0.1, 0.2, 5.0]])
    sigmas = np.diag([2e-4, 3e-4, 1e-4])
    covariances = np.tile(sigmas**2, (4, 1, 1))
    exact = SensorMotions.from_poses(np.arange(4.0), poses, covariances)
    rng = np.random.default_rng(1)
    draws = []
    for _ in range(20_000):
        xi = rng.normal(size=(4, 3)) @ sigmas
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        moved = np.column_stack([cos * xi[:, 0] - sin * xi[:, 1], sin * xi[:, 0] + cos * xi[:, 1], xi[:, 2]])
        motion = SensorMotions.from_poses(np.arange(4.0), poses + moved, covariances).motion
        draws.append(_in_frame_of_end(motion - exact.motion, exact.motion).ravel())
    scatter = np.cov(np.array(draws).T)
    assert exact.covariance is not None
    assert exact.coupling is not None
    floor = 4e-9
    for k in range(3):
        block = scatter[3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
        np.testing.assert_allclose(block, exact.covariance[k], atol=floor, rtol=0.05)
    for k in range(2):
        block = scatter[3 * k : 3 * k + 3, 3 * k + 3 : 3 * k + 6]
        np.testing.assert_allclose(block, exact.coupling[k], atol=floor, rtol=0.05)


def test_motions_of_poses_keep_whole_turns() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 4.0], [0.0, 0.0, 8.5]])
    motions = SensorMotions.from_poses(np.arange(3.0), poses, np.zeros((3, 3, 3)))
    np.testing.assert_allclose(motions.motion[:, 2], [4.0, 4.5])


def _in_frame_of_end(error: np.ndarray, motion: np.ndarray) -> np.ndarray:
    cos, sin = np.cos(motion[:, 2]), np.sin(motion[:, 2])
    x, y = error[:, 0], error[:, 1]
    return np.column_stack([cos * x + sin * y, cos * y - sin * x, error[:, 2]])


def arcs() -> tuple[OdometryLog, SensorMotions, Array]:
    """Stop-and-go arcs of a tricycle without noise, and its offset, scale, laser x, y, yaw."""
    offset, scale, x, y, yaw = truth = np.array([-0.0133, 2.5e-4, 0.39, 0.002, 0.0088])
    laser, wheelbase, ticks, now = x + 1j * y, 1.5, 0.0, 0.0
    rows, spans, motions = [], [], []
    for encoder, path in itertools.product((0.3, -0.3, 0.6, -0.6), (3.0, -2.0)):
        turn = path * np.sin(encoder + offset) / wheelbase
        base = path * np.cos(encoder + offset) * (np.exp(1j * turn) - 1.0) / (1j * turn)
        moved = np.exp(-1j * yaw) * (base + (np.exp(1j * turn) - 1.0) * laser)
        motions.append((moved.real, moved.imag, turn))
        spans.append((now + 2.0, now + 5.0))
        after = ticks + path / scale
        rows += [
            (now + 1, ticks, encoder),
            (now + 2, ticks, encoder),
            (now + 5, after, encoder),
            (now + 6, after, encoder),
        ]
        ticks, now = after, now + 6.0
    table, span = np.array(rows), np.array(spans)
    log = OdometryLog(table[:, 0], table[:, 1], table[:, 2])
    return log, SensorMotions(span[:, 0], span[:, 1], np.array(motions)), truth


def test_exact_arcs_give_the_tricycle_back() -> None:
    log, motions, truth = arcs()
    found = calibrate("auto", log, motions, wheelbase=1.5)
    assert found.model == "tricycle"
    assert found.names == ("steering_offset", "drive_scale", "laser_x", "laser_y", "laser_yaw")
    np.testing.assert_allclose(found.values, truth, rtol=1e-9)
    assert found.fixed == {"wheelbase": 1.5, "steering_gain": 1.0, "delay": 0.0}
    for form in ("wheels", "centres"):
        exact = closed_form("tricycle", log, motions, wheelbase=1.5, form=form)
        assert exact is not None
        np.testing.assert_allclose(list(exact[0].values()), truth, rtol=1e-9)


def test_a_verdict_names_what_is_missing() -> None:
    log, motions, _ = arcs()
    noisy = SensorMotions(
        motions.start, motions.end, motions.motion, np.tile(np.diag([2e-3, 2e-3, 5e-4]) ** 2, (8, 1, 1))
    )
    found = calibrate("tricycle", log, noisy, wheelbase=1.5, robust=False, noise_known=True)
    widths = dict(zip(found.names, found.half_widths(), strict=True))
    assert widths["laser_x"] == pytest.approx(1.959964 * found.sigmas[2], rel=1e-5)
    assert found.half_widths(simultaneous=True)[2] > widths["laser_x"]
    assert found.verdict({"laser_x": 1.01 * widths["laser_x"]}).enough
    verdict = found.verdict({"laser_x": 1e-5, "drive_scale": 1.0})
    assert not verdict.enough
    assert list(verdict.missed) == ["laser_x"]
    with pytest.raises(ValueError, match="tolerance of axle: the free parameters are steering_offset"):
        found.verdict({"axle": 1.0})
    with pytest.raises(ValueError, match="must be above 0"):
        found.verdict({"laser_x": 0.0})


def test_what_is_not_observed_has_no_interval() -> None:
    log, motions, _ = arcs()
    one_sided = [0, 1, 0, 1]
    few = SensorMotions(motions.start[one_sided], motions.end[one_sided], motions.motion[one_sided])
    found = calibrate("tricycle", log, few, wheelbase=1.5)
    assert len(found.weak) == 2
    assert not found.observed.any()
    assert np.isinf(found.half_widths()).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time": np.zeros(32)}, "time of reading 1 of the wheel log does not rise"),
        ({"ticks": np.full(32, np.nan)}, "reading 0 of the wheel log is not finite"),
        ({"ticks": np.zeros((32, 2))}, r"ticks have shape \(32, 2\)"),
        ({"steering": np.zeros(3)}, r"steering has shape \(3,\)"),
        ({"end": np.zeros(8)}, "motion 0 does not end after it starts"),
        ({"motion": np.zeros((8, 2))}, r"must be \(m,\), \(m,\), \(m, 3\)"),
        ({"covariance": np.zeros((8, 3, 3))}, "motion 0 has no covariance that is positive definite"),
        ({"covariance": np.zeros((8, 3))}, r"covariance has shape \(8, 3\)"),
    ],
)
def test_bad_input_is_refused(change: dict[str, Array], message: str) -> None:
    log, motions, _ = arcs()
    of_log = {key: value for key, value in change.items() if key in ("time", "ticks", "steering")}
    of_motions = {key: value for key, value in change.items() if key not in of_log}
    with pytest.raises(ValueError, match=message):
        calibrate("auto", dataclasses.replace(log, **of_log), dataclasses.replace(motions, **of_motions), wheelbase=1.5)


def test_bad_requests_are_refused() -> None:
    log, motions, _ = arcs()
    with pytest.raises(ValueError, match="the model differential needs a log of two wheels"):
        calibrate("differential", log, motions)
    with pytest.raises(ValueError, match="it is one of auto, tricycle, tricycle-asymmetric, differential"):
        calibrate("bicycle", log, motions)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="axle cannot be free in the model tricycle"):
        calibrate("tricycle", log, motions, free=("axle",))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="setting tail must be above 0"):
        calibrate("tricycle", log, motions, tail=0.0)
    with pytest.raises(ValueError, match="unknown field"):
        calibrate("tricycle", log, motions, tails=4.0)  # type: ignore[call-arg]


def test_motions_beyond_the_log_are_told_or_an_error() -> None:
    log, motions, truth = arcs()
    late = dataclasses.replace(motions, start=motions.start + 6.0, end=motions.end + 6.0)
    with pytest.raises(EstimationError, match="0 of 8 motions lie within the wheel log"):
        calibrate("tricycle", log, dataclasses.replace(late, start=late.start + 99, end=late.end + 99), wheelbase=1.5)
    cut = OdometryLog(log.time[:-4], log.ticks[:-4], None if log.steering is None else log.steering[:-4])
    found = calibrate("tricycle", cut, motions, wheelbase=1.5)
    assert "1 of 8 motions are left out: they reach beyond the wheel log" in found.notes
    assert np.isnan(found.weights).sum() == 1
    np.testing.assert_allclose(found.values, truth, rtol=1e-9)

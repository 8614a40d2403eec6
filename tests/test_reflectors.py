"""The detector of reflectors in the numpy API."""

from __future__ import annotations

import numpy as np
import pytest

from groma.features.reflectors import reflectors, reflectors_batch
from groma.nouns.messages import BeamGeometry
from groma.simulation.scenes import beam_geometry, scenario, simulate

GEOMETRY = BeamGeometry(angle_min=-0.5, angle_increment=0.005, time_increment=0, range_min=0.1, range_max=20)


def wall() -> tuple[np.ndarray, np.ndarray]:
    """A wall 4 m ahead with a strip of tape 0.3 m wide in its middle."""
    bearings = -0.5 + 0.005 * np.arange(200)
    ranges = 4 / np.cos(bearings)
    return ranges, np.where(np.abs(ranges * np.sin(bearings)) < 0.15, 900.0, 40.0)


def test_finds_a_strip_of_tape() -> None:
    found = reflectors(*wall(), GEOMETRY)
    assert len(found) == 1
    assert found.point[0] == pytest.approx([4, 0], abs=0.01)
    assert found.covariance.shape == (1, 2, 2)
    assert found.contrast[0] == pytest.approx(900 / 40)


def test_a_scan_without_intensities_has_none() -> None:
    assert len(reflectors(wall()[0], [], GEOMETRY)) == 0
    assert reflectors_batch([], [], GEOMETRY) == []


def test_mistakes_are_told() -> None:
    ranges, intensities = wall()
    with pytest.raises(ValueError, match="one length"):
        reflectors(ranges, intensities[1:], GEOMETRY)
    with pytest.raises(ValueError, match=r"contrast = 0\.5"):
        reflectors(ranges, intensities, GEOMETRY, contrast=0.5)
    with pytest.raises(ValueError, match="unknown field `colour`"):
        reflectors(ranges, intensities, GEOMETRY, colour=1)  # type: ignore[call-arg]


def test_those_of_the_warehouse_are_where_they_stand() -> None:
    run = simulate(scenario("warehouse"))
    laser = beam_geometry(run.scenario)
    some = slice(0, None, 40)
    found = reflectors_batch(list(run.ranges[some]), list(run.intensities[some]), laser)
    flat, posts = run.segments[run.segments[:, 4] > 1], run.circles[run.circles[:, 3] > 1]
    truth = np.vstack([(flat[:, :2] + flat[:, 2:4]) / 2, posts[:, :2]])
    heading = np.unwrap(run.truth[:, 2])
    normalised = []
    for scan, stamp in zip(found, run.scan_stamps[some], strict=True):
        when = stamp + scan.index * laser.time_increment
        x, y = (np.interp(when, run.stamps, run.truth[:, k]) for k in (0, 1))
        theta = np.interp(when, run.stamps, heading)
        turn = np.stack(
            [np.stack([np.cos(theta), -np.sin(theta)], -1), np.stack([np.sin(theta), np.cos(theta)], -1)], 1
        )
        seen = np.einsum("kij,kj->ki", turn, scan.point + run.scenario.scanner.mount[:2]) + np.column_stack([x, y])
        error = seen[:, None] - truth
        nearest = np.argmin(np.linalg.norm(error, axis=2), axis=1)
        error = error[np.arange(len(scan)), nearest]
        covariance = turn @ scan.covariance @ turn.transpose(0, 2, 1)
        normalised += [e @ np.linalg.solve(c, e) for e, c in zip(error, covariance, strict=True)]
    assert len(normalised) > 200
    # Two degrees of freedom; the median of a chi-square of two is 1.4.
    assert 0.7 < np.median(normalised) < 2.0
    assert np.mean(np.array(normalised) > 13.8) < 0.02

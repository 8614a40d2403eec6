"""Loop closure by corners: exact where the answer is known, refused where there is none, and the reached figures."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import groma.cli
from groma.evaluation.feature_scans import PosedScans, read_posed_scans
from groma.evaluation.loops import Answers, LoopEvaluation, evaluate_loops
from groma.evaluation.revisits import revisits
from groma.io.recording import open_recording, write_recording
from groma.mapping.recognition import recognize
from groma.nouns.messages import LaserScan, Message, Odometry
from test_evaluate_features import cast, polygon

Array = NDArray[np.float64]

HALL = [(-2, -2), (3, -2), (3, -3.4), (5, -3.4), (5, -2), (10, -2), (10, 1.5), (11.2, 1.5), (11.2, 3), (10, 3), (10, 8)]
HALL += [(6.5, 8), (6.5, 9.3), (4, 9.3), (4, 8), (1.2, 8), (1.2, 8.8), (0, 8.8), (0, 8), (-2, 8), (-2, 4.1), (-3, 4.1)]
HALL += [(-3, 2.2), (-2, 2.2)]
"""A hall with niches, none like another."""
BLOCK = [(2.2, 2), (6, 2), (6, 2.9), (6.6, 2.9), (6.6, 4), (5, 4), (5, 4.6), (2.2, 4.6)]
"""What stands in its middle."""


def walls() -> Array:
    return np.concatenate([polygon(np.array(HALL, dtype=np.float64)), polygon(np.array(BLOCK))])


def round_trip(rounds: float, step: float = 0.2) -> Array:
    """Poses on a ring around the block, heading along it."""
    angle = np.arange(0, rounds * 2 * math.pi, step / 3.7)
    x, y = 4 + 4.4 * np.cos(angle), 3.2 + 3.0 * np.sin(angle)
    heading = np.arctan2(3.0 * np.cos(angle), -4.4 * np.sin(angle))
    return np.column_stack([x, y, heading])


def drive(poses: Array) -> PosedScans:
    draw = np.random.default_rng(3)
    scans = [cast(walls(), pose, float(k)) for k, pose in enumerate(poses.tolist())]
    noisy = [replace(scan, ranges=scan.ranges + draw.normal(0, 0.01, scan.ranges.shape)) for scan in scans]
    return PosedScans("hall", "truth", noisy, poses, len(scans), 0)


@pytest.fixture(scope="module")
def twice_round() -> tuple[PosedScans, LoopEvaluation]:
    scans = drive(round_trip(1.6))
    return scans, evaluate_loops(scans)


def test_a_second_round_is_closed_and_nothing_is_closed_wrongly(twice_round: tuple[PosedScans, LoopEvaluation]) -> None:
    _, found = twice_round
    assert found.returns.sum() > 50
    assert found.precision == 1.0
    assert found.recall > 0.7
    assert found.errors[:, 0].max() < 0.1
    assert sum(found.fate.values()) == found.returns.sum()
    assert 0 <= found.retrieved[1] <= found.retrieved[5] <= found.retrieved[30] <= 1


def test_poses_only_judge(twice_round: tuple[PosedScans, LoopEvaluation]) -> None:
    """Poses that are wrong in scale change what is right, not what is found."""
    scans, found = twice_round
    scaled = evaluate_loops(replace(scans, poses=scans.poses * [1.15, 1.15, 1.0]))
    for a, b in zip(found.found.closures, scaled.found.closures, strict=True):
        assert (a.place, a.local_map, a.reason) == (b.place, b.local_map, b.reason)
        np.testing.assert_array_equal(a.transform, b.transform)
    np.testing.assert_array_equal(found.verification.score, scaled.verification.score)
    assert scaled.errors[:, 0].max() > found.errors[:, 0].max()


def test_each_closure_looks_back_and_is_explained(twice_round: tuple[PosedScans, LoopEvaluation]) -> None:
    found = twice_round[1].found
    way = found.driven[found.end]
    for closure in found.closures:
        assert way[closure.local_map] - way[closure.place] >= 10
        assert 0 <= closure.overlap <= 1
        assert closure.pairs >= 3
        assert closure.accepted == (closure.reason == "")
    assert np.all(way[1:] - way[:-1] >= 0.5 - 1e-9)
    assert np.all(way - found.driven[found.first] <= 10 + 1e-9)


def test_the_future_changes_nothing() -> None:
    """All that is known of a local map was known when it ended; only a confirmation may come later."""
    poses = round_trip(1.35)
    whole, part = recognize(drive(poses).scans), recognize(drive(poses[:-40]).scans)
    for a, b in zip(whole.proposals, part.proposals, strict=False):
        assert [(p.place, p.pairs, p.transform.tolist()) for p in a] == [
            (p.place, p.pairs, p.transform.tolist()) for p in b
        ]
    for one, other in zip(whole.candidates, part.candidates, strict=False):
        np.testing.assert_array_equal(one.place, other.place)


def test_a_return_needs_way_nearness_and_a_common_view() -> None:
    poses = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.6, 0, 0], [0.2, 0, math.pi], [0.2, 0, 0.2]])
    scans = [cast(walls(), pose, float(k)) for k, pose in enumerate(poses.tolist())]
    driven = np.array([0.0, 0.3, 0.6, 20.0, 20.0])
    found = revisits(scans, poses, driven, 10.0)
    assert [f.tolist() for f in found] == [[], [], [], [], [0, 1, 2]]
    assert [f.tolist() for f in revisits(scans, poses, driven, 0.1)][:3] == [[], [0], [1]]


def test_precision_and_recall_count_answers_and_returns() -> None:
    score = np.array([3.0, 2.0, 2.0, 1.0, -np.inf])
    right = np.array([True, False, True, True, False])
    answers = Answers(score, right, np.array([4, 0, 2, 2, 1]), 10)
    threshold, precision, recall = answers.precision_recall()
    np.testing.assert_array_equal(threshold, [3, 2, 1])
    np.testing.assert_allclose(precision, [1, 2 / 3, 3 / 4])
    np.testing.assert_allclose(recall, [0.4, 0.6, 0.8])
    assert answers.recall_without_error() == 0.4
    nothing = Answers(np.full(2, -np.inf), np.zeros(2, dtype=np.bool_), np.array([1, 1]), 2)
    assert nothing.recall_without_error() == 0.0


def write_log(scans: PosedScans, path: Path) -> None:
    messages: list[Message] = []
    for scan, pose in zip(scans.scans, scans.poses.tolist(), strict=True):
        messages += [Odometry(scan.stamp, "/odom", *pose), scan]
    write_recording(path, messages)


def test_the_command_tells_tables_json_and_a_page(
    twice_round: tuple[PosedScans, LoopEvaluation], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "hall.mcap"
    write_log(twice_round[0], log)
    assert groma.cli.run(["evaluate", "loops", str(log), "-o", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "precision" in text
    assert "1.000" in text
    told = json.loads((tmp_path / "out" / "metrics.json").read_text())
    one = told["recordings"][0]
    assert one["precision"] == 1.0
    assert one["recall"] == pytest.approx(twice_round[1].recall, abs=0.05)
    assert one["closures_accepted"] == one["closures_right"]
    assert set(one["time_s"]) == {"track", "describe", "retrieve", "associate", "verify", "decide"}
    assert (tmp_path / "out" / "report.html").read_text().count("<svg") == 1


def test_a_drive_that_never_returns_allows_no_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "away.mcap"
    write_log(drive(round_trip(0.4)), log)
    assert groma.cli.run(["evaluate", "loops", str(log)]) == 1
    assert "no scan returns to a place seen before" in capsys.readouterr().err


def test_mistakes_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert groma.cli.run(["evaluate", "loops"]) == 2
    assert groma.cli.run(["evaluate", "loops", "a", "b", "--poses", "p.tum"]) == 2
    assert groma.cli.run(["evaluate", "loops", str(tmp_path / "no.mcap")]) == 2
    capsys.readouterr()
    with pytest.raises(ValueError, match="gap = 3: it must be length or more"):
        recognize([], gap=3.0)
    with pytest.raises(ValueError, match="unknown field"):
        recognize([], nonsense=1)


def test_no_scan_no_place() -> None:
    found = recognize([])
    assert len(found.used) == 0
    assert found.closures == []
    blind = LaserScan(0.0, "/scan", "laser", drive(round_trip(0.01)).scans[0].geometry, np.full(361, np.inf))
    assert not recognize([blind]).used.any()


@pytest.mark.slow
@pytest.mark.shared
def test_intel_is_closed_without_error(shared: Path) -> None:
    found = evaluate_loops(
        read_posed_scans(open_recording(shared / "data" / "intel" / "intel-lab.flirt.log.gz"), None, 1)
    )
    assert found.precision == 1.0
    assert found.recall >= 0.7

from __future__ import annotations

import gzip
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import groma.cli
from groma.evaluation.association import Matching, look_up
from groma.evaluation.reference import evaluate_reference
from groma.evaluation.relations import evaluate_relations, read_relations
from groma.io.trajectory import Trajectory, read_tum, write_tum
from groma.nouns import poses as se2
from groma.nouns.poses import align

Array = NDArray[np.float64]


def _walk(count: int, seed: int = 0) -> Trajectory:
    rng = np.random.default_rng(seed)
    theta = np.cumsum(rng.normal(0, 0.2, count))
    xy = np.cumsum(0.3 * np.column_stack([np.cos(theta), np.sin(theta)]), axis=0)
    return Trajectory(np.cumsum(rng.uniform(0.1, 0.6, count)), np.column_stack([xy, theta]))


def _perturbed(trajectory: Trajectory, seed: int = 1) -> Trajectory:
    rng = np.random.default_rng(seed)
    noise = np.cumsum(rng.normal(0, [0.004, 0.004, 0.001], trajectory.poses.shape), axis=0)
    return Trajectory(trajectory.stamps, se2.compose(trajectory.poses, noise))


def _relations_text(truth: Trajectory, seed: int = 2) -> str:
    i, j = np.random.default_rng(seed).integers(0, len(truth.stamps), (2, 300))
    poses = se2.relative(truth.poses[i], truth.poses[j])
    rows = zip(truth.stamps[i], truth.stamps[j], poses.tolist(), strict=True)
    return "".join(f"{a:.6f} {b:.6f} {x:.9f} {y:.9f} 0 0 0 {t:.9f}\n" for a, b, (x, y, t) in rows)


def test_se2_is_the_group_of_matrices() -> None:
    def matrix(p: Array) -> Array:
        c, s = np.cos(p[2]), np.sin(p[2])
        return np.array([[c, -s, p[0]], [s, c, p[1]], [0, 0, 1]])

    a, b = np.array([1.0, -2.0, 2.5]), np.array([0.3, 4.0, 1.7])
    np.testing.assert_allclose(matrix(se2.compose(a, b)), matrix(a) @ matrix(b), atol=1e-12)
    np.testing.assert_allclose(matrix(se2.relative(a, b)), np.linalg.inv(matrix(a)) @ matrix(b), atol=1e-12)


def test_look_up_nearest_takes_the_earlier_of_two_and_keeps_the_limit() -> None:
    trajectory = Trajectory(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]))
    found = look_up(trajectory, np.array([-0.5, 0.5, 0.75, 2.5, 2.75]), Matching(max_dt=0.5))
    np.testing.assert_array_equal(found.poses[:, 0], [0, 0, 1, 2, np.nan])
    assert found.how.tolist() == ["near", "near", "near", "near", "missing"]


def test_look_up_moves_a_far_pose_by_the_odometry_in_its_own_frame() -> None:
    trajectory = Trajectory(np.array([0.0]), np.array([[5.0, 5.0, np.pi / 2]]))
    odometry = Trajectory(np.array([0.0, 3.0, 9.0]), np.array([[1.0, 0, 0], [3, 0, 0.5], [99, 0, 0]]))
    found = look_up(trajectory, np.array([3.4, 6.0]), odometry=odometry)
    np.testing.assert_allclose(found.poses[0], [5, 7, np.pi / 2 + 0.5])
    assert found.how.tolist() == ["odometry", "missing"]


def test_look_up_interpolates_across_the_half_turn_but_not_across_a_gap() -> None:
    poses = np.array([[0.0, 0, 3.0], [1, 2, -3.0], [5, 5, 0]])
    trajectory = Trajectory(np.array([0.0, 1.0, 10.0]), poses)
    found = look_up(trajectory, np.array([0.25, 1.0, 5.0, -0.05, -0.2, 10.05]), Matching("interp"))
    np.testing.assert_allclose(found.poses[0], [0.25, 0.5, 3 + (2 * np.pi - 6) / 4])
    np.testing.assert_allclose(found.poses[[1, 3, 5]], poses[[1, 0, 2]])
    assert found.how.tolist() == ["interp", "near", "missing", "near", "missing", "near"]


def test_relations_of_the_truth_have_no_error_and_a_known_offset_has_its_own(tmp_path: Path) -> None:
    truth = _walk(200)
    path = tmp_path / "truth.relations"
    path.write_text(_relations_text(truth))
    errors = evaluate_relations(read_relations(path), truth)
    assert errors.total == len(errors.translation) == 300
    assert errors.translation.max() < 1e-6
    path.write_text("0 1 3 4 0 0 0 3.0\n")
    still = Trajectory(np.array([0.0, 1.0]), np.array([[1.0, 2.0, 0.5], [1.0, 2.0, 0.5 - 3.0]]))
    errors = evaluate_relations(read_relations(path), still)
    assert errors.translation.tolist() == [5.0]
    np.testing.assert_allclose(errors.rotation, np.degrees(2 * np.pi - 6.0))


def test_ate_agrees_with_an_alignment_by_svd() -> None:
    truth = _walk(500)
    estimate = Trajectory(truth.stamps, se2.compose(np.array([3.0, -7.0, 2.0]), _perturbed(truth).poses))
    errors = evaluate_reference(estimate, truth)
    p, q = estimate.poses[:, :2], truth.poses[:, :2]
    u, _, vt = np.linalg.svd((q - q.mean(axis=0)).T @ (p - p.mean(axis=0)))
    rotation = u @ np.diag([1.0, np.linalg.det(u @ vt)]) @ vt
    aligned = (p - p.mean(axis=0)) @ rotation.T + q.mean(axis=0)
    np.testing.assert_allclose(errors.ate, np.linalg.norm(aligned - q, axis=1), atol=1e-10)
    assert errors.ate.max() > 1e-3


def test_align_finds_the_motion() -> None:
    points, motion = np.random.default_rng(5).normal(size=(20, 2)), np.array([4.0, -3.0, 2.9])
    moved = se2.compose(motion, np.column_stack([points, np.zeros(20)]))[:, :2]
    np.testing.assert_allclose(align(points, moved), motion)


def test_rpe_of_a_straight_drive_with_a_scale_error() -> None:
    x = np.arange(0, 25.5, 0.5)
    truth = Trajectory(x, np.column_stack([x, 0 * x, 0 * x]))
    estimate = Trajectory(x, truth.poses * [1.01, 1, 1])
    errors = evaluate_reference(estimate, truth)
    np.testing.assert_allclose(errors.frames.translation, 0.005)
    np.testing.assert_allclose(errors.lengths[10.0].translation, 0.1)
    assert {length: len(pairs.translation) for length, pairs in errors.lengths.items()} == {1.0: 49, 10.0: 31}


def _figures(text: str) -> list[str]:
    words = text.replace("max ", "max\n").split()
    return [word for word in words if word.replace(".", "").isdigit()]


def _both(tmp_path: Path, shared: Path, estimate: Trajectory, relations: Path, odometry: Path, *more: str) -> None:
    """Run the reference tool and ours on the same files; every figure printed must be the same text."""
    write_tum(tmp_path / "est.tum", estimate.stamps, estimate.poses)
    tool = [sys.executable, str(shared / "tools" / "slam_relations_eval.py"), str(relations), str(tmp_path / "est.tum")]
    ours = [
        sys.executable,
        "-c",
        "from groma.cli import main; main()",
        "evaluate",
        "trajectory",
        str(tmp_path / "est.tum"),
        "--relations",
    ]
    extra = list(more) if "interp" in more else ["--odometry", str(odometry), *more]
    theirs_out = subprocess.run([*tool, *extra], capture_output=True, text=True, check=True).stdout
    ours_out = subprocess.run([*ours, str(relations), *extra], capture_output=True, text=True, check=True).stdout
    for theirs_line, ours_line in zip(theirs_out.splitlines()[1:], ours_out.splitlines()[1:], strict=True):
        assert _figures(ours_line) == _figures(theirs_line)
    assert ours_out.splitlines()[0].split()[2:5] == theirs_out.splitlines()[0].split()[2:5]
    assert ours_out.split("worst gap ")[1].split()[0] == theirs_out.split("worst gap ")[1].split()[0]


@pytest.mark.shared
@pytest.mark.parametrize(
    "more", [(), ("--max-dt", "0.02"), ("--assoc", "interp"), ("--assoc", "interp", "--max-gap", "0.5")]
)
def test_figures_are_those_of_the_reference_tool(tmp_path: Path, shared: Path, more: tuple[str, ...]) -> None:
    intel = shared / "data" / "intel"
    plain = {"r": intel / "intel.relations.gz", "o": intel / "derived" / "intel_rbpf_dense.tum.gz"}
    for name, path in plain.items():
        (tmp_path / name).write_bytes(gzip.decompress(path.read_bytes()))
    estimate = _perturbed(read_tum(intel / "derived" / "intel_rbpf910.tum.gz"))
    _both(tmp_path, shared, estimate, tmp_path / "r", tmp_path / "o", *more)


@pytest.mark.shared
def test_three_thousand_relations_are_quick(shared: Path) -> None:
    intel = shared / "data" / "intel"
    start = time.process_time()
    relations = read_relations(intel / "intel.relations.gz")
    estimate = read_tum(intel / "derived" / "intel_rbpf910.tum.gz")
    odometry = read_tum(intel / "derived" / "intel_rbpf_dense.tum.gz")
    errors = evaluate_relations(relations, estimate, odometry)
    assert time.process_time() - start < 0.3
    assert len(errors.translation) == 2984


@pytest.fixture
def files(tmp_path: Path) -> dict[str, str]:
    truth = _walk(200)
    write_tum(tmp_path / "truth.tum", truth.stamps, truth.poses)
    write_tum(tmp_path / "late.tum", truth.stamps + 1e6, truth.poses)
    estimate = _perturbed(truth)
    write_tum(tmp_path / "est.tum", estimate.stamps, estimate.poses)
    (tmp_path / "r").write_text(_relations_text(truth))
    (tmp_path / "flawed.tum").write_text((tmp_path / "est.tum").read_text() * 2 + "1 nan 0 0 0 0 0 1\n")
    (tmp_path / "empty").write_text("")
    return {name: str(tmp_path / name) for name in ("truth.tum", "late.tum", "est.tum", "flawed.tum", "r", "empty")}


def _run(*arguments: str) -> int:
    return groma.cli.run(["evaluate", "trajectory", *arguments])


def test_json_by_relations(files: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(files["est.tum"], "--relations", files["r"], "--json") == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["relations_evaluated"] == figures["relations_total"] == figures["translation_m"]["count"] == 300
    assert 0 < figures["translation_m"]["mean"] < figures["translation_m"]["max"]


def test_json_and_text_by_reference(files: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(files["est.tum"], "--reference", files["truth.tum"], "--json") == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["poses_evaluated"] == 200
    assert set(figures["rpe_length_m"]) == {"1", "10"}
    assert _run(files["est.tum"], "--reference", files["truth.tum"]) == 0
    assert f"ATE              rmse {figures['ate_m']['rmse']:.3f}" in capsys.readouterr().out


def test_rows_left_out_are_told(files: dict[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(files["flawed.tum"], "--reference", files["truth.tum"]) == 0
    told = capsys.readouterr().err
    assert "values-invalid: left out: 1 rows of " in told
    assert "stamps-invalid: left out: 200 rows of " in told


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["est.tum"], "either --relations or --reference"),
        (["est.tum", "--relations", "r", "--reference", "truth.tum"], "either --relations or --reference"),
        (["empty", "--relations", "r"], "no pose in it"),
        (["est.tum", "--relations", "empty"], "no relation in it"),
        (["est.tum", "--relations", "none"], "none: cannot be read (No such file or directory)"),
        (["est.tum", "--reference", "empty"], "no pose in it"),
        (["late.tum", "--relations", "r"], "no relation has poses at both its times"),
        (["late.tum", "--reference", "truth.tum"], "only 0 poses have a reference"),
        (["est.tum", "--reference", "truth.tum", "--odometry", "truth.tum"], "--odometry serves only --relations"),
        (["est.tum", "--relations", "r", "--max-dt", "-1"], "seconds from 0"),
        (["est.tum", "--relations", "r", "--max-dt", "nan"], "--max-dt: is a number, not nan"),
    ],
)
def test_a_mistake_is_one_line_and_exit_2(
    files: dict[str, str], arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(*(files.get(argument, argument) for argument in arguments)) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""

"""Drives before one camera: the core in numpy terms, and `groma plan camera`."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from groma.cameras.calibration import projection_sigmas
from groma.cameras.survey import write_covariance
from groma.cli import run as command
from groma.errors import UserError
from groma.io.camera_info import write_camera_info
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.planning.camera import (
    DEFAULTS,
    MOTIONS,
    CameraPlan,
    Stage,
    Stop,
    Tries,
    middle_of_view,
    mount,
    plan_camera,
    ranked,
    try_motion,
)
from groma.planning.floor import foot_and_mount, from_floor, on_floor
from groma.report.camera_plan.report import instruction
from rigid import planar, seven, spatial

QUICK = replace(DEFAULTS.search, target=2.0)


def stage(height: float = 2.0) -> Stage:
    return Stage(mount(height, math.atan((height - 0.8) / 2.6)))


def seen_from(at: Stage, pose: tuple[float, float, float]) -> Detection:
    """What the camera would see, free of noise, of the panel ahead of a robot."""
    panel = at.target.panels[1]
    seen = np.linalg.inv(spatial(at.mount[:3], at.mount[3:])) @ planar(pose) @ spatial(panel.position, panel.quaternion)
    points = panel.corners @ seen[:3, :3].T + seen[:3, 3]
    pixels = at.camera.project(points)
    assert at.camera.holds(pixels).all()
    return Detection(0.0, "door", panel.name, np.arange(len(pixels)), pixels, np.full(len(pixels), 0.3))


def planned() -> CameraPlan:
    return plan_camera(stage(), (2.6, 0.0, math.pi), QUICK)


def test_a_plan_says_the_worst_pixel_that_its_covariance_has() -> None:
    plan = planned()
    assert plan.met
    for covariance, worst in ((plan.before, plan.worst_before), (plan.after, plan.end.worst)):
        assert np.nanmax(projection_sigmas(stage().camera, np.array(covariance))[1]) == pytest.approx(worst)
    assert plan.end.effort >= plan.end.length == pytest.approx(np.hypot(*np.diff(plan.poses[:, :2], axis=0).T).sum())


def test_what_is_known_before_saves_driving() -> None:
    first = planned()
    goal = replace(QUICK, target=1.5)
    on = plan_camera(stage(), first.end.pose, goal, covariance=np.array(first.after))
    anew = plan_camera(stage(), first.end.pose, goal)
    assert on.worst_before == pytest.approx(first.end.worst)
    assert on.end.effort < anew.end.effort


def test_what_was_seen_counts() -> None:
    at = stage()
    seen = [seen_from(at, (2.6, 0.0, math.pi + turn)) for turn in (-0.6, 0.0, 0.6)]
    plan = plan_camera(at, (2.6, 0.0, math.pi), QUICK, seen=seen)
    assert plan.seen == 3
    assert plan.worst_before < 0.5 * planned().worst_before


def test_common_trajectories_are_ranked_and_two_are_refused() -> None:
    found = ranked(stage(), 2.6)
    assert {judged.motion for judged in found} == set(MOTIONS)
    assert {judged.motion for judged in found if judged.degenerate} == {"stationary", "one-panel"}
    good = [judged.worst for judged in found if not judged.degenerate]
    assert good == sorted(good)
    across = next(judged for judged in found if judged.motion == "three-panels")
    assert across.effort == pytest.approx(across.length), "the panels are on its side: it need not turn"


def test_calibrations_of_a_degenerate_drive_are_refused_with_the_reason() -> None:
    tried = try_motion(stage(), "one-panel", 2.6, Tries(runs=1, views=10, seed=1))
    assert (tried.refused, tried.mean) == (1, ())
    assert "tilt" in (tried.reason or "")
    with pytest.raises(UserError, match="no drive is called 'zigzag'"):
        try_motion(stage(), "zigzag", 2.6)


def test_the_axis_meets_the_panels_where_it_should() -> None:
    assert middle_of_view(stage()) == pytest.approx(2.6)
    assert middle_of_view(Stage(mount(2.0, 0.0))) == DEFAULTS.search.depth[1], "a level camera looks far"


def test_a_camera_stands_above_its_foot_however_it_is_turned() -> None:
    foot, mounted = (3.0, -2.0, 2.5), mount(2.2, 0.6)
    roll = spatial((0, 0, 0), (0.0, 0.0, math.sin(0.05), math.cos(0.05)))
    camera = planar(foot) @ spatial(mounted[:3], mounted[3:]) @ roll
    found = foot_and_mount(seven(camera))
    assert found is not None
    assert found[0] == pytest.approx(foot)
    assert planar(found[0]) @ spatial(found[1][:3], found[1][3:]) == pytest.approx(camera)
    assert on_floor(foot, from_floor(foot, (2.0, 0.3, -1.0))) == pytest.approx((2.0, 0.3, -1.0))
    camera[2, 3] = -1.0
    assert foot_and_mount(seven(camera)) is None, "below the floor"


def test_a_drive_is_told_as_a_driver_needs_it() -> None:
    def stop(x: float, y: float, degrees: float) -> Stop:
        return Stop((x, y, math.radians(degrees)), 0, 1, 1.0, 0.0, 0.0, 0.0)

    told = instruction(stop(2, 0, 180), [stop(2, 0, 200), stop(2, 0, 225), stop(2.3, 0.3, 225), stop(2.3, 0.3, 180)])
    assert told.replace("\N{NO-BREAK SPACE}", " ") == "turn 45° left, 42 cm back, turn 45° right"


def test_a_plan_is_written_whole_and_with_the_same_bytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["plan", "camera", "--height", "2.2", "--down", "30", "--sigma", "2", "-o"]
    assert command([*line, str(tmp_path / "a")]) == 0
    assert "lowers the worst-pixel error from" in capsys.readouterr().out
    assert command([*line, str(tmp_path / "b")]) == 0
    for name in ("waypoints.csv", "plan.json", "metrics.json", "run.toml", "report.html"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    rows = list(csv.DictReader((tmp_path / "a" / "waypoints.csv").read_text().splitlines()))
    metrics = json.loads((tmp_path / "a" / "metrics.json").read_text())
    assert sum(row["views"] != "0" for row in rows) == metrics["looks"]
    assert float(rows[-1]["worst_pixel"]) == pytest.approx(metrics["worst_pixel_after"], rel=1e-5)
    assert (tmp_path / "a" / "report.html").read_text().count("<svg") == 3


def test_a_calibrated_camera_is_planned_for_with_what_it_knows(tmp_path: Path) -> None:
    camera = DEFAULTS.camera
    write_camera_info(tmp_path / "door.yaml", "door", camera)
    write_covariance(tmp_path / "door.json", camera, np.array(planned().after))
    line = ["plan", "camera", str(tmp_path / "door.yaml"), "--start", "2.6", "0", "180", "--sigma", "1.5"]
    assert command([*line, "--down", str(math.degrees(math.atan(1.2 / 2.6))), "-o", str(tmp_path / "plan")]) == 0
    metrics = json.loads((tmp_path / "plan" / "metrics.json").read_text())
    assert metrics["worst_pixel_before"] == pytest.approx(planned().end.worst, rel=1e-3)


def network(path: Path, poses: dict[str, tuple[float, ...]]) -> Path:
    """Write mapped cameras at (x, y, z, qx, qy, qz, qw)."""
    camera, covariance = DEFAULTS.camera, np.array(planned().after)
    content = {
        "version": 1,
        "frame": "map",
        "joint_covariance": None,
        "cameras": [
            {
                "name": name, "position": pose[:3], "quaternion": pose[3:], "views": 9,
                "covariance": np.eye(6).tolist(), "chi_square_per_dof": 1.0, "since": 0.0, "current": True,
                "intrinsics": {
                    "width": 640, "height": 480, "lens": camera.lens, "parameters": list(camera.parameters),
                    "covariance": covariance.tolist(),
                },
            }
            for name, pose in poses.items()
        ],
    }  # fmt: skip
    path.write_text(json.dumps(content))
    return path


def test_a_mapped_camera_is_planned_for_in_the_frame_of_the_map(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    upside_down = (0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0)
    half = math.sqrt(0.5)
    x, y, z, w = mount(2.0, 0.43)[3:]
    about_z = (half * (x - y), half * (y + x), half * (z + w), half * (w - z))
    path = network(tmp_path / "network.json", {"door": (10.0, 5.0, 2.0, *about_z), "ceiling": upside_down})
    line = ["plan", "camera", str(path), "--sigma", "1.5", "-o", str(tmp_path / "plan")]
    assert command([*line, "--name", "door", "--start", "10", "7.6", "-90"]) == 0
    rows = list(csv.DictReader((tmp_path / "plan" / "waypoints.csv").read_text().splitlines()))
    assert [float(rows[0][key]) for key in ("x", "y", "heading")] == pytest.approx([10, 7.6, -math.pi / 2], abs=1e-5)
    assert json.loads((tmp_path / "plan" / "plan.json").read_text())["stops"][0]["pose"][0] == pytest.approx(2.6)
    capsys.readouterr()
    for more, said in (
        ([], "give --name, one of door, ceiling"),
        (["--name", "roof"], "one of door"),
        (["--name", "ceiling"], "straight down"),
        (["--name", "door", "--height", "2"], "leave out --height"),
    ):
        assert command([*line, *more]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["none.yaml"], 2, "none.yaml"),
        (["--height", "-1"], 2, "height = -1"),
        (["--height", "nan"], 2, "must be"),
        (["--down", "95"], 2, "pitch"),
        (["--sigma", "0"], 2, "target = 0"),
        (["--depth", "3", "2"], 2, "farthest depth = 2"),
        (["--lambda", "-1"], 2, "lambda = -1"),
        (["--start", "9", "0", "180"], 2, "outside its area"),
        (["--focal", "600"], 2, "--image and --focal go together"),
        (["--image", "640", "480", "--focal", "-1"], 2, "--image, --focal"),
        (["--height", "9", "--down", "70"], 1, "are not reached"),
        (["--target", "none.toml"], 2, "none.toml"),
        (["--seen", "none.jsonl"], 2, "none.jsonl"),
        (
            ["--sigma", "0.001", "--side", "0.1", "--depth", "2", "2.1", "--start", "2", "0", "180"],
            1,
            "are not reached",
        ),
    ],
)
def test_an_impossible_request_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, said: str
) -> None:
    assert command(["plan", "camera", *arguments, "-o", str(tmp_path / "out")]) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_detections_that_do_not_belong_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [
        '{"stamp":1.0,"camera":"a","panel":"panel_0","ids":[0,1],"u":[1.0,2.0],"v":[1.0,2.0],"sigma":0.3}',
        '{"stamp":1.0,"camera":"b","panel":"panel_9","ids":[0,1],"u":[1.0,2.0],"v":[1.0,2.0],"sigma":0.3}',
        '{"stamp":1.0,"camera":"b","panel":"panel_0","ids":[0,999],"u":[1.0,2.0],"v":[1.0,2.0],"sigma":0.3}',
    ]
    seen = tmp_path / "detections.jsonl"
    for chosen, said in (
        (lines[:2], "is of 2 cameras"),
        (lines[1:2], "panel_9"),
        (lines[2:], "144 corners"),
        ([], "none"),
    ):
        seen.write_text("\n".join(chosen))
        assert command(["plan", "camera", "--seen", str(seen), "-o", str(tmp_path / "out")]) == 2
        assert said in capsys.readouterr().err


def test_a_fisheye_is_planned_for_as_well() -> None:
    camera = Camera(640, 480, "equidistant", (300.0, 300.0, 319.5, 239.5, 0.01, 0.0, 0.0, 0.0))
    plan = plan_camera(replace(stage(), camera=camera), (2.0, 0.0, math.pi), replace(QUICK, target=5.0))
    assert plan.end.worst < plan.worst_before

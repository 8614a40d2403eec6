"""The calibration of a vehicle from raw scans and wheels to files, against the parameters that were simulated."""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from ruamel.yaml import YAML

import groma.cli
from groma import _core
from groma.cli.demo_vehicle import calibrate_simulated
from groma.errors import EstimationError, UserError
from groma.io.quantities import amounts
from groma.io.recording import open_recording, write_recording
from groma.io.robot_files import ros2_control, urdf_joint
from groma.io.vehicle_file import read_vehicle, write_vehicle
from groma.nouns.messages import JointState
from groma.runs.run import Run
from groma.simulation.vehicle import (
    Arcs,
    CalibrationDrive,
    Continuous,
    Differential,
    Tricycle,
    calibration_scenario,
    simulate_calibration,
    true_vehicle,
)
from groma.vehicle.recording import Request, calibrate_vehicle, judged, more_driving

TOLERANCES = {
    "laser_x": 0.002,
    "laser_y": 0.002,
    "laser_yaw": math.radians(0.05),
    "steering_offset": math.radians(0.02),
    "drive_scale": 1e-4 * 0.125,
}
"""Errors that are allowed end to end, of 16 arcs."""


def arcs(drivetrain: Tricycle | Differential, count: int, seed: int = 1, period: float = 0.2) -> CalibrationDrive:
    scenario = calibration_scenario(drivetrain, seed)
    assert isinstance(scenario.program, Arcs)
    program = msgspec.structs.replace(scenario.program, angles=count // 4)
    scanner = msgspec.structs.replace(scenario.scanner, period=period)
    return simulate_calibration(msgspec.structs.replace(scenario, program=program, scanner=scanner))


@pytest.fixture(scope="module")
def eight_arcs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("arcs") / "arcs.mcap"
    write_recording(file, arcs(Tricycle(), 8))
    return file


def test_raw_scans_of_eight_arcs_tell_the_vehicle(eight_arcs: Path, tmp_path: Path) -> None:
    line = f"calibrate vehicle {eight_arcs} --wheelbase 1.5 -o {tmp_path / 'out'} --tolerance laser_x=5mm"
    assert groma.cli.run(line.split()) == 0
    vehicle = read_vehicle(tmp_path / "out" / "vehicle.toml")
    truth = true_vehicle(calibration_scenario(Tricycle()))
    assert vehicle.model == "tricycle"
    assert vehicle.joints == truth.joints
    for name in vehicle.names:
        error = vehicle.parameters[name] - truth.parameters[name]
        assert abs(error) < min(4 * vehicle.sigma(name), 2 * TOLERANCES[name]), name
    figures = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert figures["motions"] == 8
    assert figures["segments"] == "stop and go"
    assert figures["enough"] is True
    assert 0.5 < figures["noise_scale"] < 2.0
    assert figures["held_out"]["position_median_m"] < 0.02
    run = tomllib.loads((tmp_path / "out" / "run.toml").read_text())
    assert run["settings"]["calibrate"]["tolerance"] == "laser_x=5mm"
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count("<svg") == 4
    assert "the tolerance is met" in page
    assert "<script" not in page
    table = (tmp_path / "out" / "motions.csv").read_text().splitlines()
    assert len(table) == 9
    assert table[0].startswith("start,end,x,y,theta,residual_x")


def test_the_same_recording_gives_the_same_bytes(eight_arcs: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        line = f"calibrate vehicle {eight_arcs} --wheelbase 1.5 --window 2 -o {tmp_path / name}"
        assert groma.cli.run(line.split()) == 0
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == [
        "laser.urdf.xml",
        "metrics.json",
        "motions.csv",
        "report.html",
        "ros2_control.yaml",
        "run.toml",
        "vehicle.toml",
    ]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_sixteen_arcs_reach_the_bars(seed: int, tmp_path: Path) -> None:
    write_recording(tmp_path / "arcs.mcap", arcs(Tricycle(), 16, seed, period=0.1))
    result = calibrate_vehicle(open_recording(tmp_path / "arcs.mcap"), Request(wheelbase=1.5))
    truth = true_vehicle(calibration_scenario(Tricycle())).parameters
    errors = {name: result.vehicle.parameters[name] - truth[name] for name in result.found.names}
    assert all(abs(error) < TOLERANCES[name] for name, error in errors.items())
    normed = np.array([error / result.vehicle.sigma(name) for name, error in errors.items()])
    assert (np.abs(normed) < 4).all()


def test_a_differential_drive_is_found_from_its_arcs(tmp_path: Path) -> None:
    drive = arcs(Differential(), 8)
    write_recording(tmp_path / "arcs.mcap", drive)
    result = calibrate_vehicle(open_recording(tmp_path / "arcs.mcap"), Request())
    assert result.found.model == "differential"
    truth = true_vehicle(drive.scenario).parameters
    for name in result.found.names:
        assert abs(result.vehicle.parameters[name] - truth[name]) < 4 * result.vehicle.sigma(name), name
    assert result.half_widths["laser_x"] < 0.003


@pytest.mark.slow
def test_an_asymmetric_tricycle_is_recognised(tmp_path: Path) -> None:
    apart = math.radians(0.1)
    steered = Tricycle(steering_offset_backward=Tricycle().steering_offset_forward - apart)
    write_recording(tmp_path / "arcs.mcap", arcs(steered, 16))
    result = calibrate_vehicle(open_recording(tmp_path / "arcs.mcap"), Request(wheelbase=1.5))
    assert result.found.model == "tricycle-asymmetric"
    found = result.vehicle.parameters
    difference = found["steering_offset_forward"] - found["steering_offset_backward"]
    assert difference == pytest.approx(apart, abs=math.radians(0.04))


@pytest.mark.slow
def test_ordinary_driving_tells_a_delay(tmp_path: Path) -> None:
    scenario = calibration_scenario(Tricycle(), 1)
    scenario = msgspec.structs.replace(scenario, program=Continuous(60.0, 0.87), delay=0.03)
    write_recording(tmp_path / "drive.mcap", simulate_calibration(scenario))
    result = calibrate_vehicle(open_recording(tmp_path / "drive.mcap"), Request(wheelbase=1.5, free=("delay",)))
    assert result.data.segments.kind == "windows"
    assert result.vehicle.parameters["delay"] == pytest.approx(0.03, abs=0.002)
    assert result.vehicle.parameters["laser_x"] == pytest.approx(0.39028, abs=0.003)


def test_a_drive_that_does_not_determine_all_parameters_is_exit_1_with_a_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = calibration_scenario(Tricycle(), 1)
    assert isinstance(scenario.program, Arcs)
    straight = msgspec.structs.replace(scenario.program, angles=1, from_=0.5, to=0.5)
    scanner = msgspec.structs.replace(scenario.scanner, period=0.2)
    drive = simulate_calibration(msgspec.structs.replace(scenario, program=straight, scanner=scanner))
    first = drive.wheel_stamps < drive.wheel_stamps[0] + 12
    kept = [m for m in drive if m.stamp < drive.wheel_stamps[first][-1]]
    write_recording(tmp_path / "one_arc.csv", kept)
    line = f"calibrate vehicle {tmp_path / 'one_arc.csv'} --wheelbase 1.5 --window 0.5 -o {tmp_path / 'out'}"
    assert groma.cli.run(line.split()) == 1
    out, error = capsys.readouterr()
    assert "undetermined" in out
    assert "error: parameter-open: " in error
    assert not (tmp_path / "out" / "vehicle.toml").exists()
    assert "Undetermined parameters" in (tmp_path / "out" / "report.html").read_text()


def test_a_vehicle_that_never_moved_is_told(tmp_path: Path) -> None:
    drive = arcs(Tricycle(), 4)
    write_recording(tmp_path / "still.csv", [m for m in drive if m.stamp < drive.wheel_stamps[0] + 1.5])
    with pytest.raises(EstimationError, match="no motion of the sensor to calibrate by"):
        calibrate_vehicle(open_recording(tmp_path / "still.csv"), Request())


def test_wheels_without_scans_are_told(tmp_path: Path) -> None:
    drive = arcs(Tricycle(), 4, period=20.0)
    write_recording(tmp_path / "wheels.csv", [m for m in drive if isinstance(m, JointState)])
    with pytest.raises(UserError, match="neither laser scans in it nor poses of the sensor"):
        calibrate_vehicle(open_recording(tmp_path / "wheels.csv"), Request())


@pytest.mark.shared
def test_the_tracked_tricycle_through_the_command(shared: Path, tmp_path: Path) -> None:
    file = shared / "data" / "calib-tricycle" / "dataset_first_half.txt.gz"
    assert groma.cli.run(["calibrate", "vehicle", str(file), "--free", "gain", "-o", str(tmp_path / "out")]) == 0
    figures = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert figures["held_out"]["position_median_m"] < 0.011
    assert figures["source"] == "poses of the sensor from tracker_pose"


@pytest.mark.shared
def test_the_khepera_through_the_command(shared: Path) -> None:
    file = shared / "data" / "calib-censi" / "lstraight.tuple.gz"
    result = calibrate_vehicle(open_recording(file), Request())
    published = {"left_radius": 0.020885, "right_radius": 0.020948, "axle": 0.089052, "laser_yaw": 0.00949588}
    for name, value in published.items():
        assert abs(result.vehicle.parameters[name] - value) < result.half_widths[name], name


@pytest.mark.shared
@pytest.mark.slow
def test_two_drives_of_the_rover_agree(shared: Path) -> None:
    found = []
    for name in ("exp1", "exp2"):
        recording = open_recording(shared / "data" / "mines-rover" / f"{name}.dat.gz")
        found.append(calibrate_vehicle(recording, Request(free=("delay",), window=1.0)))
    for name in ("left_radius", "right_radius", "axle", "laser_x", "delay"):
        values = [result.vehicle.parameters[name] for result in found]
        widths = [result.half_widths[name] for result in found]
        assert abs(values[0] - values[1]) < math.hypot(*widths) * 1.5, name
    assert found[0].vehicle.parameters["left_radius"] == pytest.approx(0.077, rel=0.05)


def test_more_driving_is_reported_by_the_worst(eight_arcs: Path) -> None:
    result = calibrate_vehicle(open_recording(eight_arcs), Request(wheelbase=1.5))
    width = result.half_widths["laser_yaw"]
    wanting = judged(result, {"laser_yaw": width / 2, "laser_x": 1.0})
    assert not wanting.verdict.enough
    assert more_driving(wanting) == pytest.approx(4.0)
    assert more_driving(judged(result, {"laser_yaw": 2 * width})) == 1.0


def test_dead_reckoning_follows_exact_arcs() -> None:
    drive = arcs(Tricycle(steering_offset_forward=0.0, steering_offset_backward=0.0), 4, period=20.0)
    quiet = msgspec.structs.replace(
        drive.scenario,
        noise=msgspec.structs.replace(
            drive.scenario.noise, slip=0.0, steering=0.0, counter_step=0.0, steering_step=0.0
        ),
        wheel_period=0.01,
    )
    exact = simulate_calibration(quiet)
    told = _core.dead_reckoning(true_vehicle(quiet).to_json(), exact.readings, [])
    assert np.abs(told[:, :2] - exact.truth[:, :2]).max() < 1e-6


def test_amounts_have_units() -> None:
    values = {"laser_x": 0.4, "laser_yaw": -0.1}
    read = amounts("laser_x=2mm, laser_yaw = 0.5deg", values, "--tolerance")
    assert read == pytest.approx({"laser_x": 0.002, "laser_yaw": math.radians(0.5)})
    assert amounts("laser_yaw=1%", values, "--tolerance") == pytest.approx({"laser_yaw": 0.001})
    for wrong in ("laser_x", "laser_x=2miles", "mass=1", "laser_x=-1mm", "laser_x=e", "laser_x=inf"):
        with pytest.raises(UserError, match="--tolerance"):
            amounts(wrong, values, "--tolerance")


def test_files_for_ros_hold_the_numbers() -> None:
    truth = true_vehicle(calibration_scenario(Tricycle()))
    assert '<origin xyz="0.390280 0.002140 0" rpy="0 0 0.00878599"/>' in urdf_joint(truth)
    assert "wheel_radius: 0.12500000" in ros2_control(truth)
    assert "-0.7593 deg" in ros2_control(truth)
    differential = true_vehicle(calibration_scenario(Differential()))
    text = ros2_control(differential)
    assert "left_wheel_names: [left_wheel_joint]" in text
    assert "wheel_separation: 0.552000" in text
    ratio = differential.parameters["left_radius"] / 0.09995
    assert f"left_wheel_radius_multiplier: {ratio:.8f}" in text


def numbers(text: str) -> list[float]:
    """The numbers that a controller reads."""
    parameters = YAML(typ="safe").load(text)["diff_drive_controller"]["ros__parameters"]
    return [value for value in parameters.values() if isinstance(value, float)]


@pytest.mark.parametrize(("left", "right", "told"), [(1, -1, "right wheel counts backward"), (-1, -1, "are swapped")])
def test_a_controller_never_reads_a_negative_length(left: int, right: int, told: str) -> None:
    good = true_vehicle(calibration_scenario(Differential()))
    signed = {
        "left_radius": left * good.parameters["left_radius"],
        "right_radius": right * good.parameters["right_radius"],
    }
    wrong = replace(good, parameters={**good.parameters, **signed})
    text = ros2_control(wrong)
    assert told in text
    assert numbers(text) == numbers(ros2_control(good))
    assert min(numbers(text)) > 0.01
    assert "Fix first" not in ros2_control(good)
    opposite = {"left_radius": 0.1, "right_radius": -0.1}
    assert min(numbers(ros2_control(replace(good, parameters={**good.parameters, **opposite})))) > 0.01


def test_a_map_is_made_with_the_calibrated_wheels(eight_arcs: Path, tmp_path: Path) -> None:
    write_vehicle(tmp_path / "vehicle.toml", true_vehicle(calibration_scenario(Tricycle())))
    line = f"map {eight_arcs} --vehicle {tmp_path / 'vehicle.toml'} -o {tmp_path / 'map'} --resolution 0.2"
    assert groma.cli.run(line.split()) == 0
    figures = json.loads((tmp_path / "map" / "metrics.json").read_text())
    assert figures["counts"]["wheels_read"] > 1000
    assert figures["drift_odometry_max_m"] < 0.15
    assert abs(figures["counts"]["laser_offset_x_m"]) < 0.02
    assert figures["path_m"] == pytest.approx(figures["counts"]["path_m"], rel=0.1)


def test_the_demonstration_is_near_the_truth(tmp_path: Path) -> None:
    with Run("evaluation", "demo", tmp_path / "demo", command="") as run:
        result, lines = calibrate_simulated(run, tmp_path, seed=2)
        run.finish({})
    assert (tmp_path / "demo" / "vehicle" / "report.html").exists()
    assert lines[0].startswith(("Tricycle drive calibrated from", "Not yet within tolerance"))
    assert len(lines) == 1 + len(result.found.names)
    assert "off the truth by" in lines[1]
    truth = true_vehicle(calibration_scenario(Tricycle())).parameters
    assert abs(result.vehicle.parameters["laser_x"] - truth["laser_x"]) < 0.004


def test_a_cut_recording_is_used_up_to_the_cut(
    eight_arcs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = eight_arcs.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    line = f"calibrate vehicle {tmp_path / 'cut.mcap'} --wheelbase 1.5 -o {tmp_path / 'out'}"
    assert groma.cli.run(line.split()) == 0
    assert "cut or damaged" in capsys.readouterr().err
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["motions"] > 3

"""`groma localize` from a recording to its files: a short path through the simulated warehouse."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import groma.cli
from groma.io.chart import read_chart
from groma.io.landmarks import read_landmarks
from groma.io.recording import open_recording, write_recording
from groma.io.reflector_list import write_reflectors
from groma.io.trajectory import read_tum, write_tum
from groma.io.vehicle_file import read_vehicle, write_vehicle
from groma.localization.drive import Request, localizing, to_localized
from groma.mapping.mapper import beams
from groma.nouns.messages import JointState, LaserScan
from groma.runs.localization_files import save_localized
from groma.simulation.localization import Day, calibrated_vehicle, drive_scenario, drives, standing_reflectors
from groma.simulation.scenes import Simulated, simulate

RUN = "import sys, groma.cli; sys.exit(groma.cli.run(sys.argv[1:]))"


@dataclass(frozen=True)
class Depot:
    """A drive of 12 m on disk, with what a user has beside it."""

    folder: Path
    run: Simulated

    @property
    def start(self) -> str:
        """As the command takes it."""
        return ",".join(f"{value:.2f}" for value in self.run.truth[0])

    def localize(self, *arguments: str) -> int:
        """Run the command with the vehicle."""
        file, vehicle = str(self.folder / "drive.mcap"), str(self.folder / "vehicle.toml")
        return groma.cli.run(["localize", file, "--vehicle", vehicle, *arguments])

    def errors(self, out: Path) -> np.ndarray:
        """Distances of the written poses from the truth [m]."""
        found = read_tum(out / "trajectory.tum")
        truth = [np.interp(found.stamps, self.run.stamps, self.run.truth[:, k]) for k in (0, 1)]
        return np.hypot(found.poses[:, 0] - truth[0], found.poses[:, 1] - truth[1])


@pytest.fixture(scope="module")
def depot(tmp_path_factory: pytest.TempPathFactory) -> Depot:
    """Path 2 with all reflectors."""
    folder = tmp_path_factory.mktemp("depot")
    plan = drive_scenario("path2", Day(), 201)
    run = simulate(plan)
    write_recording(folder / "drive.mcap", run)
    write_tum(folder / "truth.tum", run.stamps, run.truth)
    write_vehicle(folder / "vehicle.toml", calibrated_vehicle(plan, 1))
    write_reflectors(folder / "marks.csv", standing_reflectors(run.circles, run.segments))
    return Depot(folder, run)


@pytest.fixture(scope="module")
def by_reflectors(depot: Depot) -> Path:
    """The folder of a run on surveyed reflectors."""
    out = depot.folder / "out"
    marks = str(depot.folder / "marks.csv")
    assert depot.localize("--map", marks, "--mode", "reflectors", "--start", depot.start, "-o", str(out)) == 0
    return out


def test_reflectors_place_the_vehicle_to_millimetres(depot: Depot, by_reflectors: Path) -> None:
    errors = depot.errors(by_reflectors)
    assert len(errors) > 100
    assert np.sqrt(np.mean(errors**2)) < 0.01
    metrics = json.loads((by_reflectors / "metrics.json").read_text())
    assert metrics["known_share"] == 1.0
    assert 0.5 < metrics["nis_per_dof"] < 1.3
    assert metrics["halts"] == 1


def test_every_file_is_there_and_reads_back(by_reflectors: Path) -> None:
    names = {"report.html", "trajectory.tum", "covariance.txt", "quality.csv", "stops.csv", "metrics.json", "run.toml"}
    assert {path.name for path in by_reflectors.iterdir()} == names | {"landmarks.json"}
    covariance = np.loadtxt(by_reflectors / "covariance.txt")
    assert covariance.shape == (len(read_tum(by_reflectors / "trajectory.tum").stamps), 7)
    assert (covariance[:, [1, 4, 6]] > 0).all()
    assert "/reflectors.csv" not in (by_reflectors / "run.toml").read_text()
    assert 'name = "marks.csv"' in (by_reflectors / "run.toml").read_text()
    report = (by_reflectors / "report.html").read_text()
    assert "it was never lost" in report
    assert "<script" not in report


def test_the_same_input_gives_the_same_bytes(depot: Depot, by_reflectors: Path) -> None:
    again = depot.folder / "again"
    marks = str(depot.folder / "marks.csv")
    assert depot.localize("--map", marks, "--mode", "reflectors", "--start", depot.start, "-o", str(again)) == 0
    for path in by_reflectors.iterdir():
        if path.name != "run.toml":  # it tells the command, which differs under pytest
            assert path.read_bytes() == (again / path.name).read_bytes(), path.name


def test_messages_pushed_one_by_one_give_the_bytes_of_the_command(depot: Depot, by_reflectors: Path) -> None:
    vehicle = read_vehicle(depot.folder / "vehicle.toml")
    x, y, theta = (float(part) for part in depot.start.split(","))
    chart = read_chart(depot.folder / "marks.csv")
    machine = localizing(Request(chart, {"mode": "reflectors"}, (x, y, theta)), (0.0, 0.0, 0.0), vehicle)
    for event in _events(depot.folder / "drive.mcap"):
        if isinstance(event, LaserScan):
            machine.push_scan(event.stamp, event.ranges, event.intensities, beams(event))
        else:
            machine.push_wheels(event[0], [(0, event[1]), (1, event[2])])
    found = to_localized(machine.finish(), chart)
    out = depot.folder / "pushed"
    out.mkdir()
    save_localized(found, out)
    for name in ("trajectory.tum", "covariance.txt", "quality.csv", "stops.csv", "landmarks.json"):
        assert (out / name).read_bytes() == (by_reflectors / name).read_bytes(), name


def _events(file: Path) -> list[LaserScan | tuple[float, float, float]]:
    """Return scans and readings of the wheels, those up to the end of a scan first."""
    order: list[tuple[float, int, LaserScan | tuple[float, float, float]]] = []
    for message in open_recording(file).messages():
        if isinstance(message, LaserScan):
            last = message.stamp + (len(message.ranges) - 1) * message.geometry.time_increment
            order.append((last, 1, message))
        elif isinstance(message, JointState):
            traction, steering = (
                message.positions[message.names.index(f"{j}_joint")] for j in ("traction", "steering")
            )
            order.append((message.stamp, 0, (message.stamp, float(traction), float(steering))))
    return [event for _, _, event in sorted(order, key=lambda item: item[:2])]


def test_one_thread_and_two_give_the_same_bytes(depot: Depot) -> None:
    file, vehicle, marks = (str(depot.folder / name) for name in ("drive.mcap", "vehicle.toml", "marks.csv"))
    folders = []
    for threads in ("1", "2"):
        out = depot.folder / f"threads{threads}"
        words = ["localize", file, "--vehicle", vehicle, "--map", marks, "--mode", "mixed", "--start", depot.start]
        command = [sys.executable, "-c", RUN, *words, "-o", str(out)]
        subprocess.run(command, check=True, env=os.environ | {"RAYON_NUM_THREADS": threads}, capture_output=True)
        folders.append(out)
    for path in folders[0].iterdir():
        if path.name != "run.toml":
            assert path.read_bytes() == (folders[1] / path.name).read_bytes(), path.name


def test_corners_mapped_at_known_poses_place_the_vehicle_too(depot: Depot) -> None:
    out, charted = depot.folder / "corners", depot.folder / "map"
    file, truth = str(depot.folder / "drive.mcap"), str(depot.folder / "truth.tum")
    assert groma.cli.run(["map", file, "--landmarks", truth, "-o", str(charted)]) == 0
    kinds = read_landmarks(charted / "landmarks.json").kinds.tolist()
    assert kinds.count("corner") > 50
    assert kinds.count("reflector") > 3
    assert depot.localize("--map", str(charted), "--start", depot.start, "-o", str(out)) == 0
    assert np.sqrt(np.mean(depot.errors(out) ** 2)) < 0.015


def test_without_a_map_the_frame_is_that_of_the_start(depot: Depot) -> None:
    out = depot.folder / "dynamic"
    assert depot.localize("--mode", "dynamic", "-o", str(out)) == 0
    found = read_tum(out / "trajectory.tum")
    driven = np.hypot(*(depot.run.truth[-1] - depot.run.truth[0])[:2])
    assert np.hypot(*found.poses[-1, :2]) == pytest.approx(driven, abs=0.05)


def test_plain_odometry_serves_without_a_vehicle(depot: Depot) -> None:
    out, marks = depot.folder / "odometry", str(depot.folder / "marks.csv")
    file = str(depot.folder / "drive.mcap")
    arguments = ["--map", marks, "--mode", "reflectors", "--start", depot.start, "-o", str(out)]
    assert groma.cli.run(["localize", file, *arguments]) == 0
    assert np.sqrt(np.mean(depot.errors(out) ** 2)) < 0.03


def test_mistakes_are_reported_in_a_line(depot: Depot, capsys: pytest.CaptureFixture[str]) -> None:
    marks = str(depot.folder / "marks.csv")
    empty = depot.folder / "empty"
    empty.mkdir(exist_ok=True)
    for arguments, told in (
        (["--map", marks, "--start", "here"], "--start here: expected x,y,theta"),
        (["--map", marks, "--start", "1,nan,0"], "must be finite"),
        ([], "--map: the mode static needs a map"),
        (["--map", str(empty)], "no landmarks.json in it"),
        (["--map", str(depot.folder / "gone.csv")], "gone.csv"),
    ):
        assert depot.localize(*arguments, "-o", str(depot.folder / "none")) == 2
        error = capsys.readouterr().err
        assert told in error
        assert error.count("\n") <= 3
    assert not (depot.folder / "none").exists()


def test_a_vehicle_of_other_joints_is_told(depot: Depot, capsys: pytest.CaptureFixture[str]) -> None:
    vehicle = depot.folder / "other.toml"
    vehicle.write_text((depot.folder / "vehicle.toml").read_text().replace("traction_joint", "wheel_7"))
    file, marks = str(depot.folder / "drive.mcap"), str(depot.folder / "marks.csv")
    command = ["localize", file, "--vehicle", str(vehicle), "--map", marks, "--start", depot.start]
    assert groma.cli.run([*command, "-o", str(depot.folder / "none")]) == 2
    error = capsys.readouterr().err
    assert "joints of /joint_states: traction_joint, steering_joint" in error
    assert "joints of the vehicle file" in error


def test_the_drives_of_a_simulation_have_names_and_seeds_of_their_own() -> None:
    names, kinds, seeds = zip(*drives(6), strict=True)
    assert len(set(names)) == len(set(seeds)) == 26
    assert [kinds.count(path) for path in ("survey", "path1", "path4", "halts")] == [1, 6, 6, 1]


def test_simulate_localization_refuses_nonsense(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, told in (
        (["--runs", "0"], "--runs 0"),
        (["--reflectors", "1.5"], "--reflectors 1.5"),
        (["--changed", "-0.1"], "--changed -0.1"),
        (["--seed", "-1"], "--seed -1"),
    ):
        assert groma.cli.run(["simulate", "localization", "-o", str(tmp_path / "d"), *arguments]) == 2
        assert told in capsys.readouterr().err
    assert not (tmp_path / "d").exists()

"""Good files of the text formats that groma reads, small, and the command lines that read them."""

from __future__ import annotations

import json
import math
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import msgspec
import numpy as np

from camera_scenes import poses, write_images
from drives import drive, scene
from groma.cli import run
from groma.io.camera_info import write_camera_info
from groma.io.recording import write_recording
from groma.io.trajectory import write_tum
from groma.planning.camera import DEFAULTS
from groma.simulation.vehicle import Arcs, Tricycle, calibration_scenario, simulate_calibration
from hostile.changes import all_lines, lines_of_each_kind, lines_of_table


@dataclass(frozen=True)
class Format:
    """A kind of text file and what reads it."""

    name: str
    file: str
    """Its name in the folder of good files."""
    command: tuple[str, ...]
    """``{file}`` is the changed file, ``{folder}`` its folder, ``{good}`` that of the good files."""
    spelling: str = "plain"
    separator: str | None = " "
    """Of a log: what ends the word that names the kind of a line; None where every line counts."""
    table: str = ""
    """Of a file of settings: the table that the command takes; lines of others are left as they are."""
    program: str = "groma.cli"
    """What takes the command line."""

    def lines(self, text: str) -> list[int]:
        """Which lines are changed."""
        if self.table:
            return lines_of_table(text, self.table)
        return all_lines(text) if self.separator is None else lines_of_each_kind(text, self.separator)


def room(x: float, y: float, bearings: np.ndarray) -> np.ndarray:
    """Ranges from a place in a room of 8 x 6 m."""
    c, s = np.cos(bearings), np.sin(bearings)
    with np.errstate(divide="ignore"):
        along = np.where(c > 0, (5.0 - x) / c, (-3.0 - x) / c)
        across = np.where(s > 0, (3.5 - y) / s, (-2.5 - y) / s)
    nearest: np.ndarray = np.minimum(np.abs(along), np.abs(across))
    return nearest


def carmen(path: Path) -> None:
    """A drive of 3 m through the room, with ODOM, FLASER and ROBOTLASER1 lines."""
    bearings = np.radians(np.arange(180) - 90.0)
    lines = ["PARAM robot_frontlaser_offset 0.2\n"]
    for k in range(30):
        x = 0.1 * k
        ranges = " ".join(f"{r:.3f}" for r in room(x + 0.2, 0.0, bearings))
        lines.append(f"ODOM {x} 0 0 0 0 0 {100 + 0.5 * k} host {0.5 * k}\n")
        lines.append(f"FLASER 180 {ranges} {x + 0.2} 0 0 {x} 0 0 {100.1 + 0.5 * k} host {0.5 * k}\n")
    path.write_text("".join(lines))


def robotlaser(path: Path) -> None:
    """The same with the geometry on the lines."""
    bearings = np.radians(np.arange(180) - 90.0)
    lines = []
    for k in range(30):
        x = 0.1 * k
        ranges = " ".join(f"{r:.3f}" for r in room(x, 0.0, bearings))
        head = f"ROBOTLASER1 0 {-math.pi / 2:.6f} {math.pi:.6f} {math.radians(1):.6f} 30 0.01 0 180 {ranges} 0"
        lines.append(f"{head} {x} 0 0 {x} 0 0 0 0 0 0 0 {100 + 0.5 * k} host {0.5 * k}\n")
    path.write_text("".join(lines))


def dpslam(path: Path) -> None:
    """Odometry and Laser lines."""
    bearings = np.radians(np.arange(180) - 90.0)
    lines = []
    for k in range(30):
        ranges = " ".join(f"{r:.3f}" for r in room(0.1 * k, 0.0, bearings))
        lines += [f"Odometry {0.1 * k} 0 0\n", f"Laser 180 {ranges}\n"]
    path.write_text("".join(lines))


def encoder_log(path: Path) -> None:
    """A steered vehicle whose sensor is tracked."""
    lines = ["#kinematic_model: traction_drive_wheel\n", "#joints_max_enc_values: 8192 5000\n"]
    x = y = theta = 0.0
    for k in range(400):
        steering = 0.4 * math.sin(0.05 * k)
        step = 0.02
        theta += step * math.sin(steering) / 1.4
        x, y = x + step * math.cos(steering) * math.cos(theta), y + step * math.cos(steering) * math.sin(theta)
        ticks = f"{round(steering * 8192 / math.tau)} {round(k * step / 0.0106 * 5000 / 100)}"
        sensor = f"{x + 1.5 * math.cos(theta):.6f} {y + 1.5 * math.sin(theta):.6f} {theta:.6f}"
        lines.append(f"time: {1000 + 0.05 * k:.3f} ticks: {ticks} model_pose: {x} {y} {theta} tracker_pose: {sensor}\n")
    path.write_text("".join(lines))


def mines(path: Path) -> None:
    """A rover that drives 2 m."""
    bearings = np.radians((np.arange(682) - 340.5) * 360 / 1024)
    rows = []
    for k in range(40):
        ranges = [round(1000 * r) for r in np.minimum(room(0.05 * k, 0.0, bearings), 5.5)]
        counts = round(0.05 * k / 0.077 / math.tau * 2000)
        rows.append(" ".join(map(str, [100000 * k, 0, counts, counts, *[0] * 21, *ranges])) + "\n")
    path.write_text("".join(rows))


def motion_tuples(path: Path) -> None:
    """Intervals of a differential drive with the motion of its sensor."""
    rows = []
    for k in range(60):
        left, right = 1.0 + 0.3 * math.sin(k), 1.0 + 0.3 * math.cos(1.7 * k)
        travel, turn = 0.02 * (left + right) / 2, 0.02 * (right - left) / 0.09
        rows.append(json.dumps({"T": 1.0, "phi_l": left, "phi_r": right, "sm": [travel, 0.1 * turn, turn]}) + "\n")
    path.write_text("".join(rows))


def csv_of_wheels(path: Path) -> None:
    """Arcs of a tricycle with scans, as groma CSV."""
    full = calibration_scenario(Tricycle())
    assert isinstance(full.program, Arcs)
    scanner = msgspec.structs.replace(full.scanner, period=0.4, beams=271, angle_increment=math.radians(1.0))
    made = simulate_calibration(
        msgspec.structs.replace(full, program=msgspec.structs.replace(full.program, angles=1), scanner=scanner)
    )
    write_recording(path, made)


def ticks(good: Path, path: Path) -> None:
    """The same with counts in place of angles."""
    rows: list[str] = []
    for row in (good / "wheels.csv").read_text().splitlines():
        fields = row.split(",")
        if fields[0] == "JOINTS":
            names, positions = fields[4::3], [round(float(p) * 5000 / math.tau) for p in fields[5::3]]
            pairs = ",".join(f"{name},{count}" for name, count in zip(names, positions, strict=True))
            if not any(r.startswith("ENCODER") for r in rows):
                rows += [f"ENCODER,{fields[2]},{name},5000,4294967296" for name in names]
            row = f"TICKS,{fields[1]},{fields[2]},{len(names)},{pairs}"
        rows.append(row)
    path.write_text("\n".join(rows) + "\n")


def relations(path: Path) -> None:
    """Two true relations."""
    path.write_text("101 103 0.2 0 0 0 0 0\n102 105 0.3 0 0 0 0 0\n")


def pose_graph(path: Path) -> None:
    """A square that is driven twice, closed once."""
    lines = [
        f"VERTEX_SE2 {k} {(0, 1, 1, 0)[k % 4]} {(0, 0, 1, 1)[k % 4]} {0.5 * math.pi * (k % 4)}\n" for k in range(8)
    ]
    for k in range(7):
        lines.append(f"EDGE_SE2 {k} {k + 1} 1.02 0.01 1.57 100 0 0 100 0 400\n")
    path.write_text("".join([*lines, "EDGE_SE2 0 4 0.05 0.02 0.01 50 1 0 50 2 200\n", "FIX 0\n"]))


GRAPH = """start: a
nodes:
  a: [0, 0]
  b: [8, 0]
  c: {at: [8, 6], camera: true}
  d: {at: [0, 6], camera: false}
edges:
  - [a, b]
  - {between: [b, c], via: [[9, 2], [9, 4]]}
  - [c, d]
  - [d, a]
"""

KALIBR = "target_type: aprilgrid\ntagCols: 6\ntagRows: 6\ntagSize: 0.08\ntagSpacing: 0.3\n"

CAMCHAIN = """cam0:
  camera_model: pinhole
  intrinsics: [600.0, 600.0, 319.5, 239.5]
  distortion_model: radtan
  distortion_coeffs: [-0.2, 0.05, 0.001, 0.001]
  resolution: [640, 480]
  rostopic: /door
"""


def network(good: Path) -> None:
    """A mapped camera."""
    camera = DEFAULTS.camera
    lens = {"width": camera.width, "height": camera.height, "lens": camera.lens, "parameters": list(camera.parameters)}
    mapped = {
        "name": "door", "position": [0.0, 0.0, 2.0], "quaternion": [0.66, -0.66, 0.26, -0.26], "views": 9,
        "covariance": (1e-4 * np.eye(6)).tolist(), "chi_square_per_dof": 1.0, "since": 0.0, "current": True,
        "intrinsics": {**lens, "covariance": np.eye(len(camera.parameters)).tolist()},
    }  # fmt: skip
    content = {"version": 1, "frame": "map", "joint_covariance": None, "cameras": [mapped]}
    (good / "network.json").write_text(json.dumps(content, indent=1))


def settings(good: Path) -> None:
    """The defaults of all commands that have settings."""
    with redirect_stdout(StringIO()) as printed:
        assert run(["config"]) == 0
    (good / "settings.toml").write_text(printed.getvalue())


def make(good: Path) -> None:
    """Write all good files into a folder."""
    for name, write in {
        "carmen.log": carmen, "robotlaser.log": robotlaser, "dpslam.log": dpslam, "encoder.txt": encoder_log,
        "mines.dat": mines, "tuples.txt": motion_tuples, "wheels.csv": csv_of_wheels, "true.relations": relations,
        "graph.g2o": pose_graph,
    }.items():  # fmt: skip
        write(good / name)
    ticks(good, good / "ticks.csv")
    (good / "graph.yaml").write_text(GRAPH)
    (good / "camchain.yaml").write_text(CAMCHAIN)
    (good / "april.yaml").write_text(KALIBR)
    write_camera_info(good / "door.yaml", "door", DEFAULTS.camera)
    step = math.radians(1.5)
    driven = drive(scene("rooms", beams=181, angle_increment=step, angle_min=-90 * step, period=0.25), 12)
    driven.write(good / "drive.csv")
    truth = driven.truth
    write_tum(good / "truth.tum", truth.stamps, truth.poses)
    assert run(["map", str(good / "drive.csv"), "-o", str(good / "map")]) == 0
    (good / "marks.csv").write_text("x,y,sigma\n" + "".join(f"{x},{y},0.01\n" for x, y in ((1, 2), (3, -2), (6, 1))))
    assert run(["calibrate", "vehicle", str(good / "wheels.csv"), "-o", str(good / "vehicle")]) in (0, 1)
    assert run(["simulate", "cameras", "loop", "-o", str(good / "survey"), "--seed", "2"]) == 0
    write_images(good / "images", poses(6, seed=1))
    network(good)
    settings(good)


MAP = ("map", "{file}", "-o", "out")
VEHICLE = ("calibrate", "vehicle", "{file}", "-o", "out")
LOCALIZE = ("localize", "{good}/drive.csv", "--start", "0,0,0", "-o", "out")
PLAN = ("plan", "exploration", "{file}", "-o", "out")
CAMERA = ("plan", "camera", "--sigma", "2", "-o", "out")
SURVEY = ("cameras", "map", "{folder}", "-o", "out")

SETTINGS = tuple(
    Format(f"settings of {table}", "settings.toml", (*command, "--config", "{file}", "-o", "out"), table=table)
    for table, command in {
        "map": ("map", "{good}/drive.csv"),
        "localize": ("localize", "{good}/drive.csv", "--map", "{good}/map"),
        "calibrate": ("calibrate", "vehicle", "{good}/wheels.csv"),
        "cameras": ("cameras", "map", "{good}/survey"),
        "camera": ("calibrate", "camera", "{good}/images", "--target", "{good}/april.yaml"),
        "plan_camera": ("plan", "camera"),
        "plan_vehicle": ("plan", "vehicle", "--tolerance", "laser_x=5mm"),
        "exploration": ("plan", "exploration", "{good}/graph.yaml"),
    }.items()
)

FORMATS = (
    Format("CARMEN", "carmen.log", MAP),
    Format("CARMEN with geometry", "robotlaser.log", MAP),
    Format("DP-SLAM", "dpslam.log", MAP),
    Format("groma CSV", "drive.csv", MAP, separator=","),
    Format("groma CSV, inspected", "drive.csv", ("inspect", "{file}"), separator=","),
    Format("wheels as CSV", "wheels.csv", VEHICLE, separator=","),
    Format("ticks as CSV", "ticks.csv", VEHICLE, separator=","),
    Format("encoder log", "encoder.txt", (*VEHICLE, "--poses", "tracker_pose")),
    Format("MINES log", "mines.dat", MAP),
    Format("MINES log, wheels", "mines.dat", VEHICLE),
    Format("motion tuples", "tuples.txt", VEHICLE),
    Format("TUM, judged", "truth.tum", ("evaluate", "trajectory", "{file}", "--reference", "{good}/truth.tum")),
    Format("TUM, reference", "truth.tum", ("evaluate", "trajectory", "{good}/truth.tum", "--reference", "{file}")),
    Format("TUM, known poses", "truth.tum", ("map", "{good}/drive.csv", "--landmarks", "{file}", "-o", "out")),
    Format("relations", "true.relations", ("evaluate", "trajectory", "{good}/truth.tum", "--relations", "{file}")),
    Format("nav2 map", "map/map.yaml", (*LOCALIZE, "--map", "{file}"), "yaml", None),
    Format("nav2 map, explored", "map/map.yaml", PLAN, "yaml", None),
    Format("landmark map", "map/landmarks.json", (*LOCALIZE, "--map", "{file}"), "json", ","),
    Format("reflector list", "marks.csv", (*LOCALIZE, "--map", "{file}", "--mode", "mixed"), separator=None),
    Format(
        "vehicle",
        "vehicle/vehicle.toml",
        ("map", "{good}/wheels.csv", "--vehicle", "{file}", "-o", "out"),
        separator=None,
    ),
    Format(
        "vehicle, planned for",
        "vehicle/vehicle.toml",
        ("plan", "vehicle", "--vehicle", "{file}", "--tolerance", "laser_x=5mm", "-o", "out"),
        separator=None,
    ),
    Format("building", "graph.yaml", PLAN, "yaml", None),
    Format("camchain", "camchain.yaml", (*CAMERA, "{file}"), "yaml", None),
    Format("camera_info", "door.yaml", (*CAMERA, "{file}"), "yaml", None),
    Format("network", "network.json", (*CAMERA, "{file}"), "json", None),
    Format("target of Kalibr", "april.yaml", (*CAMERA, "--target", "{file}"), "yaml", None),
    Format("target", "survey/target.toml", SURVEY, separator=None),
    Format("cameras of a survey", "survey/cameras/camera1.yaml", SURVEY, "yaml", None),
    Format("detections", "survey/detections.jsonl", SURVEY, "json", ":"),
    Format("odometry of a survey", "survey/odometry.csv", SURVEY, separator=","),
    Format("pose graph", "graph.g2o", ("{file}",), program="graphs"),
    *SETTINGS,
)

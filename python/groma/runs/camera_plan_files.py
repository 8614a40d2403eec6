"""A drive before one camera as files.

`waypoints.csv`: one line per stop, the start first: number of the stop and of the drive that it is on, x, y [m],
heading [rad] on the floor (origin at the foot of the camera, x where it looks, y to the left; of a mapped camera, in
the frame of the map), panels seen anew (where none are, the camera need not look), distance so far [m], worst standard
deviation of a pixel then [pixel], standard deviation of the camera's place that odometry added so far [m].

`plan.json`: the same on the floor before the camera, with its `foot` (x, y, heading in the map, else zeros) and the
covariances of the camera's parameters before and after.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import msgspec

from groma.io.atomic import write_text
from groma.nouns.camera import Camera
from groma.nouns.poses import Pose
from groma.planning.camera import CameraPlan
from groma.planning.floor import from_floor

VERSION = 1


def write_camera_waypoints(path: Path, plan: CameraPlan, foot: Pose = (0.0, 0.0, 0.0)) -> None:
    """Write the views of a plan as CSV, in the frame in which the foot of the camera is given."""
    lines = ["look,drive,x,y,heading,views,distance,worst_pixel,odometry_sigma"]
    for number, stop in enumerate(plan.stops):
        values = (*from_floor(foot, stop.pose), stop.views, stop.length, stop.worst, math.sqrt(stop.variance))
        lines.append(f"{number},{stop.leg}," + ",".join(f"{value:.6g}" for value in values))
    write_text(path, "\n".join(lines) + "\n")


def write_camera_plan(path: Path, camera: Camera, plan: CameraPlan, foot: Pose = (0.0, 0.0, 0.0)) -> None:
    """Write a plan as JSON."""
    content = {
        "version": VERSION,
        "frame": "foot of the camera, x where it looks, y to the left, z up",
        "foot": list(foot),
        "units": {"length": "m", "angle": "rad", "image": "px"},
        "camera": msgspec.to_builtins(camera),
        "parameters": list(camera.names),
        "met": plan.met,
        "stops": [msgspec.to_builtins(stop) for stop in plan.stops],
        "covariance_before": plan.before,
        "covariance_after": plan.after,
    }
    write_text(path, json.dumps(content, indent=1) + "\n")

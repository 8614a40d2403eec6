"""Print what calibrations from images scatter by common trajectories, against corners drawn with noise.

.venv/bin/python benches/motions.py [RUNS]

Images are rendered with lens, blur and noise, and the corners found in them by the real detector, which claims a noise
for each. The set-up is that of `groma evaluate motions`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from groma.cameras.calibration import calibrate_camera, projection_sigmas
from groma.cameras.vision import detect
from groma.errors import EstimationError
from groma.nouns.detection import Detection
from groma.nouns.poses import rotation_matrix
from groma.planning.camera import DEFAULTS, Judged, Stage, middle_height, mount, ranked
from groma.simulation.rendering import render

Array = NDArray[np.float64]
HEIGHT, DISTANCE = 2.0, 2.6


def main() -> None:
    """Print a line a drive."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    stage = Stage(mount(HEIGHT, math.atan2(HEIGHT - middle_height(DEFAULTS.target), DISTANCE)))
    tell(
        "drive         panels  corner [px]   fx [%]: images, claimed   worst pixel: images, claimed   error/claim  [s]"
    )
    for judged in ranked(stage, DISTANCE):
        began = monotonic()
        errors, claims, sigma, panels, reason = tried(stage, judged, runs)
        if not errors:
            tell(f"{judged.motion:13} refused {runs} times: {reason}")
            continue
        claim = np.mean(claims, axis=0)
        scatter = sum(np.outer(error, error) for error in errors) / len(errors)
        share = np.mean([e @ np.linalg.solve(c, e) for e, c in zip(errors, claims, strict=True)]) / len(claim)
        fx = [100 * math.sqrt(c[0, 0]) / stage.camera.parameters[0] for c in (scatter, claim)]
        worst = [float(np.nanmax(projection_sigmas(stage.camera, c)[1])) for c in (scatter, claim)]
        tell(
            f"{judged.motion:13} {panels:6}  {sigma:11.3f}  {fx[0]:15.2f}, {fx[1]:7.2f}  {worst[0]:20.2f}, "
            f"{worst[1]:7.2f}  {share:11.2f}  {monotonic() - began:3.0f}"
        )


def tried(stage: Stage, judged: Judged, runs: int) -> tuple[list[Array], list[Array], float, int, str]:
    """Return errors and claimed covariances of calibrations, the noise of corners, panels a run, why refused."""
    errors, claims, sigmas, reason = [], [], [], ""
    for run in range(runs):
        seen = thinned(looks(stage, judged, seed=1000 * run), DEFAULTS.tries.views)
        sigmas += [float(np.median(detection.sigma)) for detection in seen]
        try:
            found = calibrate_camera((stage.camera.width, stage.camera.height), judged.shown, seen, {"splits": 0})
        except EstimationError as error:
            reason = str(error)
            continue
        errors.append(np.array(found.camera.parameters) - np.array(stage.camera.parameters))
        claims.append(found.claimed)
    return errors, claims, float(np.median(sigmas)), len(seen), reason


def pose(position: Sequence[float], quaternion: Sequence[float]) -> Array:
    """Return a pose as (4, 4); the quaternion is x, y, z, w."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation_matrix(np.array(quaternion)), position
    return matrix


def looks(stage: Stage, judged: Judged, seed: int) -> list[Detection]:
    """Return what is detected in the images of a drive."""
    camera = np.linalg.inv(pose(stage.mount[:3], stage.mount[3:]))
    found = []
    for number, stop in enumerate(judged.stops):
        places = [pose(panel.position, panel.quaternion) for panel in judged.shown.panels]
        poses = [
            camera @ pose((*stop[:2], 0.0), (0.0, 0.0, np.sin(stop[2] / 2), np.cos(stop[2] / 2))) @ place
            for place in places
        ]
        image = render(stage.camera, judged.shown, poses, seed=seed + number)
        found += detect(image, judged.shown, camera="camera", stamp=float(number))[0]
    return found


def thinned(seen: list[Detection], most: int) -> list[Detection]:
    """Return detections evenly along the drive, at most so many."""
    count = min(len(seen), most)
    return [seen[(2 * k + 1) * len(seen) // (2 * count)] for k in range(count)]


def tell(line: str) -> None:
    """Write a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()

"""Calibrate a camera: intrinsics and lens distortion, with standard deviations, from images of a target.

The target is an AprilTag grid as Kalibr prints it. Its images are rendered here with lens, blur and noise;
with images of your own, `groma.io.images.read_images` reads a folder.

Prints every parameter with its standard deviation and its true value, and the reprojection error.
The last line is the error of the focal length, below 0.5 px.
"""

import numpy as np

from groma.cameras.calibration import calibrate_camera
from groma.cameras.vision import detect
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.poses import quaternion_of_rpy, rotation_matrix
from groma.nouns.target import Panel, TagGrid, Target
from groma.simulation.rendering import render

truth = Camera(640, 480, "radtan", (600.0, 606.0, 322.0, 237.0, -0.25, 0.08, 0.001, -0.0005))
target = Target((Panel("board", TagGrid(columns=4, rows=4, size=0.12, spacing=0.3)),))
middle = target.panels[0].corners.mean(axis=0)

random = np.random.default_rng(1)
detections: list[Detection] = []
for k in range(14):  # the board faces the camera, tilted, its middle at some pixel and distance
    roll, pitch, yaw = random.uniform(-0.6, 0.6, 3)
    ray = truth.unproject(random.uniform((200, 160), (440, 320)))[0]
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrix(np.array(quaternion_of_rpy(np.pi + roll, pitch, yaw)))
    pose[:3, 3] = random.uniform(1.0, 1.4) * ray - pose[:3, :3] @ middle
    found, _ = detect(render(truth, target, [pose], seed=k), target, stamp=float(k))
    detections += found

result = calibrate_camera((640, 480), target, detections)

for name, estimate, sigma, true in zip(
    result.camera.names, result.camera.parameters, result.sigmas, truth.parameters, strict=True
):
    print(f"{name} = {estimate:10.5f} ± {sigma:.5f}, true {true:10.5f}")
print(f"reprojection error (RMS): {result.rms:.3f} px in {len(result.views)} images")
print(f"error of the focal length: {abs(result.camera.parameters[0] - truth.parameters[0]):.3f} px")

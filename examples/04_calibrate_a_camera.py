"""Calibrate a camera: find a grid of AprilTags in images, estimate the intrinsics with their standard deviations.

Prints the focal length with its standard deviation and the error of it.
"""

import math

import numpy as np

from groma.cameras.calibration import calibrate_camera
from groma.cameras.vision import detect
from groma.nouns.camera import Camera
from groma.nouns.poses import quaternion_of_rpy, rotation_matrix
from groma.nouns.target import Panel, TagGrid, Target
from groma.simulation.rendering import render

truth = Camera(640, 480, "radtan", (600.0, 606.0, 322.0, 237.0, -0.25, 0.08, 0.001, -0.0005))
target = Target((Panel("panel", TagGrid(columns=6, rows=6, size=0.08, spacing=0.3)),))

detections = []
for k in range(8):
    pose = np.eye(4)  # T_camera_panel: tilted another way in each image, all over the view
    pose[:3, :3] = rotation_matrix(np.array(quaternion_of_rpy(math.pi + 0.5 * math.sin(k), 0.5 * math.cos(k), 0.3 * k)))
    pose[:3, 3] = [0.1 * math.cos(2 * k), 0.08 * math.sin(2 * k), 1.1] - pose[:3, :3] @ [0.3, 0.3, 0.0]
    image = render(truth, target, [pose], seed=k)
    found, _ = detect(image, target, stamp=float(k))
    detections += found

result = calibrate_camera((640, 480), target, detections)
fx, sigma = result.camera.parameters[0], math.sqrt(result.covariance[0, 0])
print(f"fx {fx:.2f} +- {sigma:.2f} px from {len(detections)} images, error {fx - truth.parameters[0]:+.2f} px")

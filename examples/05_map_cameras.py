"""Map the cameras of a building: a robot with a target drives past cameras whose fields of view do not overlap.

Prints how many cameras were located, the largest error, and how far odometry alone ends from the truth.
"""

import numpy as np

from groma.cameras.network import NetworkMapper
from groma.simulation.network import network_scene, simulate_network

survey = simulate_network(network_scene("hallway", seed=1))
mapper = NetworkMapper(survey.scene.target, survey.scene.known())
for message, stop in survey.messages():  # odometry of the robot and detections of the cameras, in any order
    mapper.push(message, stop)
network = mapper.finish(survey.scene.settings())

truth = {camera.name: pose for camera, pose in zip(survey.scene.cameras, survey.cameras, strict=True)}
errors = [float(np.linalg.norm(camera.pose[:3] - truth[camera.name][:3])) for camera in network.cameras]
odometry = float(np.linalg.norm(network.odometry[-1, :2] - survey.stops[-1, :2]))
worst = 1000 * max(errors)
print(f"{len(errors)} cameras located, largest error {worst:.0f} mm; odometry alone ends {odometry:.2f} m off")

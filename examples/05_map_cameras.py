"""Map the cameras of a building whose fields of view do not overlap.

A robot with a target on it drives ten laps of a hallway of 50 m (simulated) and stops before each of seven cameras.
Every camera reports the corners of the target that it sees; odometry connects the cameras.

Prints the error of each camera's position with its standard deviation, and how far odometry alone is off.
The last line is the largest error of a position, below 150 mm.
"""

import numpy as np

from groma.cameras.network import NetworkMapper
from groma.simulation.network import network_scene, simulate_network

scene = network_scene("hallway")
simulated = simulate_network(scene)

mapper = NetworkMapper(scene.target, scene.known())
for message, stop in simulated.messages():
    mapper.push(message, stop)  # odometry and detections, in any order
network = mapper.finish(scene.settings())

truth = {camera.name: pose for camera, pose in zip(scene.cameras, simulated.cameras, strict=True)}
errors = []
for camera in network.cameras:
    x, y, z = camera.pose[:3]
    error = np.linalg.norm(camera.pose[:3] - truth[camera.name][:3])
    sigma = np.sqrt(np.trace(camera.covariance[:3, :3]))
    errors.append(error)
    print(
        f"{camera.name} at ({x:6.2f}, {y:6.2f}, {z:5.2f}) m: error {1000 * error:3.0f} mm, sigma {1000 * sigma:3.0f} mm"
    )

drift = np.linalg.norm(network.odometry[-1, :2] - simulated.stops[-1, :2])
print(f"error of odometry alone after {network.path_length:.0f} m: {drift:.2f} m")
print(f"largest error of a position: {1000 * max(errors):.0f} mm")

"""Print how well `groma cameras map` finds the cameras of the hallway from rendered images, seed by seed.

.venv/bin/python benches/network.py [SEEDS]
"""

from __future__ import annotations

import sys
from time import monotonic

import numpy as np

from groma.cameras.network import NetworkMapper
from groma.nouns.network import NetworkMap
from groma.nouns.poses import rotation_matrix
from groma.simulation.network import SimulatedNetwork, network_scene, simulate_network
from groma.simulation.rendered_network import rendered_messages


def errors(network: NetworkMap, simulated: SimulatedNetwork) -> np.typing.NDArray[np.float64]:
    """Return the errors (K, 6) of position [m] and rotation [rad] of the cameras, in the axes of the map."""
    names = [camera.name for camera in simulated.scene.cameras]
    rows = []
    for camera in network.cameras:
        truth = simulated.cameras[names.index(camera.name)]
        turn = rotation_matrix(truth[3:]) @ rotation_matrix(camera.pose[3:]).T
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        rows.append([*(truth[:3] - camera.pose[:3]), *axis])
    return np.array(rows)


def tell(line: str) -> None:
    """Write a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Run the seeds one after the other."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    total, count = 0.0, 0
    tell("seed  NEES/dof  worst position [m]  worst rotation [deg]  odometry alone [m]  images and detection [s]")
    for seed in range(1, seeds + 1):
        simulated = simulate_network(network_scene("hallway", seed))
        mapper = NetworkMapper(simulated.scene.target, simulated.scene.known())
        start = monotonic()
        for message, stop in rendered_messages(simulated):
            mapper.push(message, stop)
        seconds = monotonic() - start
        network = mapper.finish(simulated.scene.settings())
        off = errors(network, simulated)
        nees = off.ravel() @ np.linalg.solve(np.asarray(network.joint), off.ravel())
        total, count = total + nees, count + off.size
        worst = np.linalg.norm(off[:, :3], axis=1).max(), np.degrees(np.linalg.norm(off[:, 3:], axis=1).max())
        tell(
            f"{seed:4}  {nees / off.size:8.2f}  {worst[0]:18.3f}  {worst[1]:20.2f}  "
            f"{network.odometry_error:18.2f}  {seconds:24.0f}"
        )
    tell(f"all   {total / count:8.2f}")


if __name__ == "__main__":
    main()

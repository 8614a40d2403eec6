"""Map a recording: laser scans and odometry become a nav2 map and a trajectory.

A drive through an office floor is simulated and written as an MCAP file; put the name of your own CARMEN log, ROS bag
or CSV in its place. The map is written as map.yaml and map.pgm, the trajectory in TUM format, for evo.

Prints what the map is made of, and the absolute trajectory error (ATE) of odometry alone.
The last line is the ATE of the map (RMS), below 20 mm.
"""

from pathlib import Path

import numpy as np

from groma.evaluation.reference import evaluate_reference
from groma.io.nav2_map import write_map
from groma.io.recording import open_recording, write_recording
from groma.io.trajectory import read_tum, write_tum
from groma.mapping.mapper import map_drive
from groma.recordings.drive import open_drive
from groma.simulation.scenes import scenario, simulate

simulated = simulate(scenario("turns"))
write_recording("office.mcap", simulated)
write_tum(Path("truth.tum"), simulated.stamps, simulated.truth)

result = map_drive(open_drive(open_recording("office.mcap")), {})

write_map(Path("map.yaml"), result.grid)
write_tum(Path("trajectory.tum"), result.trajectory_stamps, result.trajectory)
write_tum(Path("odometry.tum"), result.trajectory_stamps, result.odometry)

height, width = result.grid.cells.shape
accepted = sum(closure.accepted for closure in result.closures)
print(f"map: {result.verdict}, {width} x {height} cells of {result.grid.resolution} m")
print(f"pose graph: {len(result.graph.poses)} nodes, {accepted} loop closures")


def ate(name: str) -> float:
    """Return the ATE of a trajectory file after alignment (RMS) [m]."""
    errors = evaluate_reference(read_tum(Path(name)), read_tum(Path("truth.tum"))).ate
    return float(np.sqrt(np.mean(errors**2)))


print(f"ATE of odometry alone (RMS): {ate('odometry.tum'):.1f} m")
print(f"ATE of the map (RMS): {1000 * ate('trajectory.tum'):.0f} mm")

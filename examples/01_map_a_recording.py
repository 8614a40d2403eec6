"""Map a recording: simulate a drive, write it as a ROS 2 bag, map it, and compare the map with the ground truth.

Prints the number of loop closures and the largest error of the trajectory.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from groma.evaluation.reference import evaluate_reference
from groma.io.nav2_map import write_map
from groma.io.recording import open_recording, write_recording
from groma.io.trajectory import Trajectory
from groma.mapping.mapper import map_drive
from groma.recordings.drive import open_drive
from groma.simulation.scenes import scenario, simulate

drive = simulate(scenario("rooms", seed=1))
with TemporaryDirectory() as folder:
    bag = Path(folder) / "drive.mcap"
    write_recording(bag, drive)  # any log or bag that groma reads can stand here
    result = map_drive(open_drive(open_recording(bag)), {})
    write_map(Path(folder) / "map.yaml", result.grid)  # and map.pgm, as nav2 reads them

closures = sum(closure.accepted for closure in result.closures)
estimate = Trajectory(result.trajectory_stamps, result.trajectory)
errors = evaluate_reference(estimate, Trajectory(drive.stamps, drive.truth))
print(f"{result.verdict}: {closures} loop closures, largest error {errors.ate.max():.3f} m")

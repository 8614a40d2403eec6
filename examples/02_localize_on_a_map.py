"""Localize a vehicle: reflectors are the map, a simulated AGV drives through a depot; its pose is known at each scan.

Prints the share of scans at which the pose was known and the largest error of those.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from groma.evaluation.reference import evaluate_reference
from groma.io.recording import open_recording, write_recording
from groma.io.trajectory import Trajectory
from groma.localization.drive import Request, localize_drive
from groma.localization.localizer import reflectors
from groma.nouns.maps import Chart
from groma.recordings.drive import open_vehicle_drive
from groma.simulation.localization import Day, calibrated_vehicle, drive_scenario, standing_reflectors
from groma.simulation.scenes import simulate

plan = drive_scenario("path1", Day(), 1)
drive = simulate(plan)
chart = Chart(reflectors(standing_reflectors(drive.circles, drive.segments), sigma=0.002))
x, y, theta = drive.truth[0].tolist()

with TemporaryDirectory() as folder:
    bag = Path(folder) / "drive.mcap"
    write_recording(bag, drive)
    recording = open_vehicle_drive(open_recording(bag), calibrated_vehicle(plan, 1))
    result = localize_drive(recording, Request(chart, {"mode": "reflectors"}, (x, y, theta)))

known = result.status != "lost"
estimate = Trajectory(result.stamps[known], result.poses[known])
errors = evaluate_reference(estimate, Trajectory(drive.stamps, drive.truth))
print(f"pose known at {np.mean(known):.0%} of the scans, largest error {1000 * errors.ate.max():.0f} mm")

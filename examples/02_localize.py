"""Localize a vehicle on a map of landmarks, without an initial pose.

The map is a list of surveyed reflectors in a warehouse. The vehicle, a simulated tricycle with odometry and a laser
scanner, starts anywhere: it is lost until the reflectors in view fit one place only, and is then tracked.

Prints when the pose was found, and what standard deviation the localization reports.
The last line is the largest error of the position, below 30 mm.
"""

from pathlib import Path

import numpy as np

from groma.io.chart import read_chart
from groma.io.recording import open_recording, write_recording
from groma.io.reflector_list import write_reflectors
from groma.localization.drive import Request, localize_defaults, localize_drive
from groma.recordings.drive import open_drive
from groma.simulation.localization import Day, drive_scenario, standing_reflectors
from groma.simulation.scenes import simulate

simulated = simulate(drive_scenario("path2", Day(), seed=1))
write_recording("drive.mcap", simulated)
write_reflectors(Path("reflectors.csv"), standing_reflectors(simulated.circles, simulated.segments))

options = localize_defaults()
options["mode"] = "reflectors"
request = Request(read_chart(Path("reflectors.csv")), options)
result = localize_drive(open_drive(open_recording("drive.mcap")), request)

known = result.status != "lost"
print(f"map: {len(request.chart.landmarks.positions)} reflectors")
print(f"pose known in {known.sum()} of {len(known)} scans, first after {result.found_after:.2f} m")
print(f"standard deviation of the position (median): {1000 * np.median(result.sigma_position[known]):.1f} mm")

x, y = (np.interp(result.stamps[known], simulated.stamps, simulated.truth[:, k]) for k in (0, 1))
errors = np.hypot(result.poses[known, 0] - x, result.poses[known, 1] - y)
print(f"error of the position (median): {1000 * np.median(errors):.1f} mm")
print(f"largest error of the position: {1000 * errors.max():.1f} mm")

"""Calibrate a tricycle: its steering and driven wheel, and the pose of its laser scanner, from one recording.

The vehicle drives eight arcs from stop to stop in a hall (simulated). The recording has the joint states of the wheels
and the scans; no initial values are needed. The wheelbase was measured by hand.

Prints every parameter with its 95 % interval and its true value.
The last line is the error of the laser position, below 2 mm.
"""

import numpy as np
from msgspec.structs import replace

from groma.io.recording import open_recording, write_recording
from groma.simulation.vehicle import Tricycle, calibration_scenario, simulate_calibration, true_vehicle
from groma.vehicle.recording import Request, calibrate_vehicle

scenario = calibration_scenario(Tricycle(wheelbase=1.5))
scenario = replace(
    scenario,
    program=replace(scenario.program, angles=2),  # of the steering, each left and right, forward and backward
    scanner=replace(scenario.scanner, period=0.2),
)
write_recording("agv.mcap", simulate_calibration(scenario))

result = calibrate_vehicle(open_recording("agv.mcap"), Request(wheelbase=1.5))

truth = true_vehicle(scenario).parameters
print("parameter [m, rad]   estimate   interval (95 %)      truth")
for name, half_width in result.half_widths.items():
    estimate = result.vehicle.parameters[name]
    print(f"{name:17} {estimate:11.5f}        ± {half_width:.5f} {truth[name]:11.5f}")

x, y, _ = result.vehicle.laser
print(f"error of the laser position: {1000 * np.hypot(x - truth['laser_x'], y - truth['laser_y']):.2f} mm")

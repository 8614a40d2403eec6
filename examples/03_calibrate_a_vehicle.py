"""Calibrate a tricycle: wheel encoders and laser scans of eight arcs in, wheel and laser parameters with intervals out.

Prints each parameter with its 95 % interval and its error, and how many intervals contain the truth.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from msgspec.structs import replace

from groma.io.recording import open_recording, write_recording
from groma.io.vehicle_file import write_vehicle
from groma.simulation.vehicle import Arcs, Tricycle, calibration_scenario, simulate_calibration, true_vehicle
from groma.vehicle.recording import Request, calibrate_vehicle

scenario = calibration_scenario(Tricycle(), seed=1)
assert isinstance(scenario.program, Arcs)
fewer = replace(scenario.program, angles=2)  # two steering angles and five scans a second are enough here
scenario = replace(scenario, program=fewer, scanner=replace(scenario.scanner, period=0.2))
truth = true_vehicle(scenario).parameters
with TemporaryDirectory() as folder:
    bag = Path(folder) / "arcs.mcap"
    write_recording(bag, simulate_calibration(scenario))
    result = calibrate_vehicle(open_recording(bag), Request(wheelbase=truth["wheelbase"]))
    write_vehicle(Path(folder) / "vehicle.toml", result.vehicle)  # what groma map and localize take with --vehicle

inside = 0
for name, value in result.found.parameters.items():
    if name in result.half_widths:
        error, width = value - truth[name], result.half_widths[name]
        inside += abs(error) <= width
        print(f"{name:16} {value:9.5f} +- {width:.5f}   error {error:+.5f}")
print(f"{inside} of {len(result.half_widths)} intervals contain the truth")

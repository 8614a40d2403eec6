"""The part of a demonstration that calibrates a vehicle: a simulated tricycle on eight arcs, with its ground truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec

from groma.io.recording import write_recording
from groma.report.vehicle.words import WORDS, amount, verdict_words
from groma.runs.record import shown_command
from groma.runs.run import Run
from groma.runs.vehicle import calibrate_into
from groma.simulation.vehicle import Arcs, Tricycle, calibration_scenario, simulate_calibration, true_vehicle
from groma.vehicle.recording import CalibratedVehicle, Request

TOLERANCE = "laser_x=2mm,laser_y=2mm,laser_yaw=0.05deg,steering_offset=0.02deg"
PERIOD = 0.2
"""Time between scans: enough for the standstills, and half the work of the usual scanner [s]."""


def calibrate_simulated(whole: Run, recordings: Path, seed: int) -> tuple[CalibratedVehicle, list[str]]:
    """Simulate a drive, calibrate its vehicle into a folder, and say how far that is from the truth.

    Parameters
    ----------
    whole
        The run of the demonstration; its folder gets the folder ``vehicle``, as `groma calibrate vehicle` makes it.
    recordings
        Folder for ``agv.mcap``.
    seed
        Draws the hall and all noise.

    Returns
    -------
    tuple
        The calibration, and lines for a person.
    """
    scenario = calibration_scenario(Tricycle(), seed)
    if isinstance(scenario.program, Arcs):
        program = msgspec.structs.replace(scenario.program, angles=2)
        scanner = msgspec.structs.replace(scenario.scanner, period=PERIOD)
        scenario = msgspec.structs.replace(scenario, program=program, scanner=scanner)
    truth = true_vehicle(scenario)
    recording = recordings / "agv.mcap"
    write_recording(recording, simulate_calibration(scenario, whole.token))
    request = Request(wheelbase=truth.parameters["wheelbase"])
    command = shown_command(["calibrate", "vehicle", recording.name, "--wheelbase", str(request.wheelbase)])
    with Run("vehicle", "calibrate vehicle", whole.folder / "vehicle", command=command, within=whole) as run:
        result = calibrate_into(run, run.open(recording), request, TOLERANCE)
    return result, [f"{verdict_words(result)}.", *_errors(result, truth.parameters)]


def _errors(result: CalibratedVehicle, truth: Mapping[str, float]) -> list[str]:
    """Return a line per parameter: estimate, interval, error."""
    lines = []
    for name, value, sigma in zip(
        result.found.names, result.found.values.tolist(), result.found.sigmas.tolist(), strict=True
    ):
        shown, width = (amount(name, x, sigma, result) for x in (value, result.half_widths[name]))
        off = amount(name, value - truth[name], sigma, result)
        lines.append(f"  {WORDS[name]}: {shown} ± {width}, off the truth by {off}")
    return lines

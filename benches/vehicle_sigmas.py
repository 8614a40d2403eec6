"""Whether the stated sigmas of a calibration agree with its errors: many simulated recordings.

    python benches/vehicle_sigmas.py [RUNS [FOLDER]]

Each seed draws another hall, another noise of the scans and of the wheels (``groma simulate vehicle``: slip, a steering
error that remembers, encoders in steps), and is calibrated from its raw scans. For each parameter

    ratio = root mean square of the errors / root mean square of the stated sigmas

is 1 where sigmas are right, above 1 where they are too small. By chance alone it lies within 1 +- 2 / sqrt(2 RUNS), two
times in three within half of that. Two answers are printed: that of the command (``calibrate_vehicle`` on the
recording) and that of the estimator alone (``calibrate`` on the same readings and motions). The recordings are kept in
FOLDER, so that another version of groma can be given the same.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np

from groma.cli.simulate_vehicle import vehicle as simulate_vehicle
from groma.io.recording import open_recording
from groma.nouns.vehicle import Model
from groma.simulation.vehicle import Differential, Tricycle, calibration_scenario, true_vehicle
from groma.vehicle.calibration import VehicleCalibration, calibrate
from groma.vehicle.recording import Request, calibrate_vehicle

Drive = Literal["arcs", "continuous"]

WHEELBASE = 1.5
"""Of the simulated tricycle [m], measured by hand as usual."""
CELLS: tuple[tuple[Model, Drive], ...] = (("tricycle", "arcs"), ("tricycle", "continuous"), ("differential", "arcs"))


def main(runs: int, folder: Path) -> None:
    """Print the ratios of all cells."""
    say(f"{runs} recordings a cell: 1 +- {2.0 / np.sqrt(2.0 * runs):.2f} by chance (two standard deviations)")
    for model, drive in CELLS:
        recordings = [_recording(folder, model, drive, seed) for seed in range(1, runs + 1)]
        _say(f"{model}, {drive}", [_answers(file, model) for file in recordings], _truth(model))


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _recording(folder: Path, model: Model, drive: Drive, seed: int) -> Path:
    file = folder / f"{model}-{drive}-{seed}.mcap"
    if not file.exists():
        simulate_vehicle(output=file, model=model, drive=drive, arcs=16, duration=60.0, seed=seed)
    return file


def _truth(model: Model) -> Mapping[str, float]:
    drivetrain = Differential() if model == "differential" else Tricycle()
    return true_vehicle(calibration_scenario(drivetrain)).parameters


def _answers(file: Path, model: Model) -> dict[str, VehicleCalibration]:
    wheelbase = None if model == "differential" else WHEELBASE
    result = calibrate_vehicle(open_recording(file), Request(model, wheelbase=wheelbase))
    alone = calibrate(model, result.data.log, result.data.motions, wheelbase=wheelbase)
    return {"command": result.found, "estimator": alone}


def _say(cell: str, answers: list[dict[str, VehicleCalibration]], truth: Mapping[str, float]) -> None:
    for which in answers[0]:
        found = [answer[which] for answer in answers]
        say(f"{cell}: {which}")
        for k, name in enumerate(found[0].names):
            errors = np.array([f.values[k] for f in found]) - truth[name]
            error, sigma = (np.sqrt(np.mean(v**2)) for v in (errors, np.array([f.sigmas[k] for f in found])))
            say(f"  {name:16} ratio {error / sigma:5.2f}   error {error:.2e}   mean {errors.mean():9.2e}")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    with tempfile.TemporaryDirectory() as made:
        main(count, Path(sys.argv[2]) if len(sys.argv) > 2 else Path(made))

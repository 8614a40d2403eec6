"""The part of a demonstration that localizes: a depot is mapped, pallets are moved, and a drive finds itself in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.cli.localize import localize_into
from groma.cli.map import map_into
from groma.io.chart import read_chart
from groma.io.drive import open_drive
from groma.io.recording import open_recording, write_recording
from groma.io.results import run_record, shown_command
from groma.io.vehicle_file import read_vehicle, write_vehicle
from groma.localization import LocalizerOptions, localizer_defaults
from groma.localization_simulation import Day, calibrated_vehicle, drive_scenario
from groma.localize import Request
from groma.localized import Localized
from groma.mapper import map_defaults
from groma.report.localization_report import localization_verdict
from groma.simulation import Simulated, simulate

CHANGED = 0.2
"""Share of the pallets that were moved since the depot was mapped."""


def localize_simulated(directory: Path, seed: int) -> tuple[Localized, list[str]]:
    """Simulate two days in a depot, map the first, localize the second, and say how far that is from the truth.

    Parameters
    ----------
    directory
        Exists; gets ``survey.mcap``, ``drive.mcap``, ``vehicle.toml``, a folder ``map``, and the files of
        `groma localize`.
    seed
        Draws the building and all noise.

    Returns
    -------
    tuple
        The localization, and lines for a person.
    """
    plan = drive_scenario("survey", Day(seed), seed)
    first = simulate(plan)
    later = simulate(drive_scenario("path1", Day(seed, day=1, changed=CHANGED), seed + 1))
    write_recording(directory / "survey.mcap", first)
    write_recording(directory / "drive.mcap", later)
    write_vehicle(directory / "vehicle.toml", calibrated_vehicle(plan, seed))
    chart = directory / "map"
    chart.mkdir(exist_ok=True)
    survey = open_drive(open_recording(directory / "survey.mcap"))
    map_into(chart, survey, map_defaults(), shown_command(["map", "survey.mcap"]))
    result = _localize(directory)
    return result, [f"{localization_verdict(result)}.", _accuracy(result, first, later)]


def _localize(directory: Path) -> Localized:
    recording, vehicle = directory / "drive.mcap", directory / "vehicle.toml"
    settings = localizer_defaults()
    request = Request(read_chart(directory / "map"), LocalizerOptions(**settings), None, read_vehicle(vehicle))
    words = ["localize", recording.name, "--map", "map", "--vehicle", vehicle.name]
    run = run_record({"localize": {**settings, "start": "unknown"}}, recording, shown_command(words))
    drive = open_drive(open_recording(recording), odometry="none")
    return localize_into(directory, drive, request, run | {"map": "map", "vehicle": vehicle.name})


def _accuracy(result: Localized, first: Simulated, later: Simulated) -> str:
    """Return the error against the truth as one sentence; the map has its origin at the first pose of the survey."""
    known = result.status != "lost"
    truth = _seen_from(first.truth[0], _at(result.stamps[known], later))
    off = np.hypot(*(result.poses[known, :2] - truth[:, :2]).T)
    median, worst = 1000 * float(np.median(off)), 1000 * float(off.max())
    return (
        f"Measured against the truth: {median:.0f} mm in the median, {worst:.0f} mm at most, "
        f"with {CHANGED:.0%} of the pallets moved."
    )


def _at(stamps: NDArray[np.float64], run: Simulated) -> NDArray[np.float64]:
    """Return true poses (n, 3) at some times."""
    x, y, theta = run.truth[:, 0], run.truth[:, 1], np.unwrap(run.truth[:, 2])
    return np.column_stack([np.interp(stamps, run.stamps, column) for column in (x, y, theta)])


def _seen_from(origin: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return poses in the frame of another."""
    cos, sin = np.cos(origin[2]), np.sin(origin[2])
    x, y = (poses[:, :2] - origin[:2]).T
    return np.column_stack([cos * x + sin * y, cos * y - sin * x, poses[:, 2] - origin[2]])

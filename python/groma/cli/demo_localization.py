"""The part of a demonstration that localizes: a depot is mapped, pallets are moved, and a drive finds itself in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.io.chart import read_chart
from groma.io.recording import write_recording
from groma.io.vehicle_file import read_vehicle, write_vehicle
from groma.localization.drive import Request, localize_defaults
from groma.localization.options import LocalizeOptions
from groma.localization.result import Localized
from groma.mapping.mapper import map_defaults
from groma.nouns.poses import relative
from groma.recordings.drive import open_drive, open_vehicle_drive
from groma.report.localization.report import localization_verdict
from groma.runs.localization import localize_into
from groma.runs.map import map_into
from groma.runs.record import shown_command
from groma.runs.run import Run
from groma.simulation.localization import Day, calibrated_vehicle, drive_scenario
from groma.simulation.scenes import Simulated, simulate

CHANGED = 0.2
"""Share of the pallets that were moved since the depot was mapped."""


def localize_simulated(whole: Run, recordings: Path, seed: int) -> tuple[Localized, list[str]]:
    """Simulate two days in a depot, map the first, localize the second, and say how far that is from the truth.

    Parameters
    ----------
    whole
        The run of the demonstration; its folder gets ``depot``, as `groma map` makes it, and ``localization``.
    recordings
        Folder for ``survey.mcap``, ``drive.mcap`` and ``vehicle.toml``.
    seed
        Draws the building and all noise.

    Returns
    -------
    tuple
        The localization, and lines for a person.
    """
    plan = drive_scenario("survey", Day(seed), seed)
    first = simulate(plan, whole.token)
    later = simulate(drive_scenario("path1", Day(seed, day=1, changed=CHANGED), seed + 1), whole.token)
    write_recording(recordings / "survey.mcap", first)
    write_recording(recordings / "drive.mcap", later)
    write_vehicle(recordings / "vehicle.toml", calibrated_vehicle(plan, seed))
    chart = whole.folder / "depot"
    with Run("map", "map", chart, command=shown_command(["map", "survey.mcap"]), within=whole) as run:
        map_into(run, open_drive(run.open(recordings / "survey.mcap")), map_defaults())
    result = _localize(whole, recordings, chart)
    return result, [f"{localization_verdict(result)}.", _accuracy(result, first, later)]


def _localize(whole: Run, recordings: Path, chart: Path) -> Localized:
    vehicle = recordings / "vehicle.toml"
    command = shown_command(["localize", "drive.mcap", "--map", chart.name, "--vehicle", vehicle.name])
    settings = localize_defaults()
    request = Request(read_chart(chart), LocalizeOptions(**settings))
    with Run("localization", "localize", whole.folder / "localization", command=command, within=whole) as run:
        run.settings = {"localize": {**settings, "start": "unknown"}}
        recording = run.open(recordings / "drive.mcap")
        run.inputs |= {"map": chart, "vehicle": vehicle}
        return localize_into(run, open_vehicle_drive(recording, read_vehicle(vehicle)), request)


def _accuracy(result: Localized, first: Simulated, later: Simulated) -> str:
    """Return the error against the ground truth as one sentence; the map starts at the first pose of the survey."""
    known = result.status != "lost"
    truth = relative(first.truth[0], _at(result.stamps[known], later))
    off = np.hypot(*(result.poses[known, :2] - truth[:, :2]).T)
    median, worst = 1000 * float(np.median(off)), 1000 * float(off.max())
    return (
        f"Error against the ground truth: {median:.0f} mm in the median, {worst:.0f} mm at most, "
        f"with {CHANGED:.0%} of the pallets moved."
    )


def _at(stamps: NDArray[np.float64], run: Simulated) -> NDArray[np.float64]:
    """Return true poses (n, 3) at some times."""
    x, y, theta = run.truth[:, 0], run.truth[:, 1], np.unwrap(run.truth[:, 2])
    return np.column_stack([np.interp(stamps, run.stamps, column) for column in (x, y, theta)])

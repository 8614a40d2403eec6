"""How a vehicle finds itself without a start: in the simulated warehouse, and on the Intel log.

    python benches/localization_start.py [PLACES [DATA]]

Warehouse: the site of ``localization.py`` (map from poses by surveyed reflectors), another day with a tenth of the
pallets moved. From each of PLACES scans, spread evenly over a drive through all aisles the other way round than mapped,
which sways ``SWAY`` m to either side, the vehicle drives on until it says where it is, ``FAR`` m at most. Right: within
``NEAR`` m and ``TURNED`` degrees of the truth.
Intel (DATA/intel/derived/intel_raw3361.clf.gz): the first half of the log is mapped, the second half localized; errors
are against the map of the whole log, whose frame is laid on that of the half such that the first half fits best.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import msgspec
import numpy as np
from localization import PLAN, Array, Site, moved, poses_at, relative, say, survey
from numpy.typing import NDArray

from groma.features.association import rigid_fit
from groma.io.recording import open_recording, write_recording
from groma.localization.drive import Request, localize_drive, localizing
from groma.localization.localizer import Pose
from groma.localization.options import LocalizeOptions
from groma.localization.result import Localized
from groma.mapping.mapper import map_drive
from groma.nouns.maps import Chart, chosen
from groma.recordings.drive import open_drive
from groma.simulation.localization import Day, drive_scenario
from groma.simulation.scenes import Simulated, beam_geometry, simulate

SWAY = 0.4
NEAR, TURNED = 0.3, 5.0
"""A place found is right within so much [m, degrees]."""
FAR = 10.0
"""The vehicle drives on so far [m]."""
SCAN = 0.15
"""A way that takes one scan [m]."""


def places(site: Site, chart: Chart, name: str, count: int) -> None:
    """Tell how often the start is found in the warehouse."""
    plain = drive_scenario("back", Day(PLAN, 1, 0.1), 3)
    run = simulate(msgspec.structs.replace(plain, limits=msgspec.structs.replace(plain.limits, sway=SWAY)))
    starts = np.linspace(0, len(run.scan_stamps) - 110, count).astype(int)
    ways, errors = [], []
    for start in starts.tolist():
        found = _drive_until_found(site, chart, run, start)
        if found is not None:
            way, stamp, pose = found
            ways.append(way)
            truth = moved(relative(site.t_world_map[None], np.zeros((1, 3)))[0], poses_at(run, np.array([stamp])))
            errors.append(relative(truth, np.array([pose]))[0])
    table, way = np.array(errors).reshape(-1, 3), np.array(ways)
    right = (np.hypot(table[:, 0], table[:, 1]) < NEAR) & (np.abs(np.degrees(table[:, 2])) < TURNED)
    say(
        f"{name}: {count} places, {right.sum() / count:.1%} found right, {(~right).sum()} wrong, "
        f"{count - len(right)} not found within {FAR:.0f} m; {np.mean(way < SCAN):.0%} of the found from one scan, "
        f"way {np.median(way):.1f} m in the median, {np.quantile(way, 0.95):.1f} m for 95 %"
    )


def _drive_until_found(site: Site, chart: Chart, run: Simulated, start: int) -> tuple[float, float, Pose] | None:
    """Return the way until the vehicle knows where it is, when and where; None when it never does."""
    machine = localizing(Request(chart, {}), site.vehicle.laser, site.vehicle)
    geometry = beam_geometry(run.scenario)
    edges = (geometry.angle_min, geometry.angle_increment, geometry.time_increment, geometry.range_min)
    beams = (*edges, geometry.range_max)
    k = int(np.searchsorted(run.stamps, run.scan_stamps[start], side="right"))
    first = k
    for s in range(start, len(run.scan_stamps)):
        stamp = float(run.scan_stamps[s])
        end = stamp + (run.ranges.shape[1] - 1) * geometry.time_increment
        while k < len(run.stamps) and run.stamps[k] <= end:
            machine.push_wheels(float(run.stamps[k]), list(enumerate(run.joints[k].tolist())))
            k += 1
        machine.push_scan(stamp, run.ranges[s], run.intensities[s], beams)
        state = machine.state()
        way = float(np.hypot(*np.diff(run.truth[first : k + 1, :2], axis=0).T).sum())
        if state is not None and state[3]["status"] != "lost":
            return way, state[0], state[1]
        if way > FAR:
            return None
    return None


def intel(log: Path, folder: Path) -> None:
    """Map the first half of the Intel log, localize the second."""
    messages = sorted(open_recording(log).messages(), key=lambda message: message.stamp)
    middle = messages[len(messages) // 2].stamp
    halves = folder / "first.mcap", folder / "second.mcap"
    write_recording(halves[0], [message for message in messages if message.stamp <= middle])
    write_recording(halves[1], [message for message in messages if message.stamp > middle])
    half = map_drive(open_drive(open_recording(halves[0])), {})
    whole = map_drive(open_drive(open_recording(log)), {})
    early = whole.trajectory_stamps <= half.trajectory_stamps[-1]
    first = _at(half.trajectory_stamps, half.trajectory, whole.trajectory_stamps[early])
    fit = rigid_fit(first[:, :2], whole.trajectory[early, :2])
    if fit is None:
        raise RuntimeError("the two maps of the first half do not fit")
    options: tuple[LocalizeOptions, ...] = ({"mode": "static"}, {"mode": "mixed"})
    for option in options:
        found = localize_drive(open_drive(open_recording(halves[1])), Request(Chart(half.landmarks, half.grid), option))
        truth = moved(fit.transform, _at(whole.trajectory_stamps, whole.trajectory, found.stamps))
        _tell(f"Intel, second half, {option['mode']}", found, relative(truth, found.poses))


def _tell(name: str, found: Localized, errors: Array) -> None:
    known = found.status != "lost"
    distance = np.hypot(errors[known, 0], errors[known, 1])
    after = "never" if found.found_after is None else f"after {found.found_after:.1f} m"
    say(
        f"{name}: found {after}, known for {known.mean():.1%}, {int(found.counts['times_lost'])} times lost; "
        f"error median {np.median(distance):.3f} m, 95 % {np.quantile(distance, 0.95):.3f} m, "
        f"largest {distance.max():.3f} m, heading {np.degrees(np.median(np.abs(errors[known, 2]))):.2f} deg; "
        f"NIS {found.nis.sum() / max(found.dof.sum(), 1):.2f}, "
        f"paired {found.matched.mean():.1f} of {found.observed.mean():.1f}"
    )


def _at(stamps: Array, poses: Array, when: Array) -> Array:
    columns = (poses[:, 0], poses[:, 1], np.unwrap(poses[:, 2]))
    return np.column_stack([np.interp(when, stamps, column) for column in columns])


def main(arguments: Iterable[str]) -> None:
    """Run both."""
    given = list(arguments)
    count = int(given[0]) if given else 200
    with tempfile.TemporaryDirectory() as folder:
        _, site = survey(Path(folder))
        corners: NDArray[np.bool_] = site.chart.landmarks.kinds == "corner"
        places(site, Chart(chosen(site.chart.landmarks, corners), site.chart.grid), "corners", count)
        places(site, site.chart, "corners and reflectors", count)
        if len(given) > 1:
            intel(Path(given[1]) / "intel/derived/intel_raw3361.clf.gz", Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])

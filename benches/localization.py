"""Localization in a simulated warehouse, compared with the ground truth: halting points, paths, moved pallets.

    python benches/localization.py [RUNS]

The warehouse is surveyed once, on a day with all reflectors. Maps of it: ``own``, by ``groma map`` (its frame is laid
on the world such that the path of the survey fits its truth best); ``reference``, the survey localized by surveyed
reflectors (3 mm off), corners mapped at the poses found. All drives come on another day, with a calibrated vehicle
whose parameters are off by what a calibration leaves. For a share of the reflectors those that do not hang are taken
from the map.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groma.features.association import rigid_fit
from groma.io.recording import open_recording, write_recording
from groma.io.reflector_list import SIGMA, surveyed
from groma.io.trajectory import Trajectory
from groma.localization.drive import Request, localize_drive
from groma.localization.localizer import LocalizerOptions
from groma.localization.result import Localized
from groma.mapping.known_poses import survey as survey_at
from groma.mapping.mapper import map_drive
from groma.nouns.maps import Chart, Landmarks, chosen, joined, no_landmarks
from groma.nouns.poses import relative
from groma.nouns.vehicle import Vehicle
from groma.recordings.drive import open_drive, open_vehicle_drive
from groma.simulation.localization import PATHS, Day, DriveName, calibrated_vehicle, drive_scenario, standing_reflectors
from groma.simulation.scenes import Simulated, simulate

Array = NDArray[np.float64]

PLAN = 1
MOVED = 0.1
"""Share of the pallets that were moved since the survey, where not said."""
SHARES = (1.0, 0.5, 0.25, 0.0)
"""Of the reflectors."""
WRONG = 0.2
"""A run whose second half has a larger error is lost [m]."""
HERE = 0.3
"""A mark of the map stands where one hangs within this distance [m]."""


@dataclass(frozen=True)
class Site:
    """The mapped warehouse."""

    chart: Chart
    t_world_map: Array
    """x, y, theta."""
    vehicle: Vehicle
    folder: Path


def survey(folder: Path) -> tuple[Site, Site]:
    """Map the warehouse: by groma map, and at poses that navigation by surveyed reflectors gave."""
    plan = drive_scenario("survey", Day(PLAN), 1)
    run = simulate(plan)
    path = folder / "survey.mcap"
    write_recording(path, run)
    vehicle = calibrated_vehicle(plan, PLAN)
    result = map_drive(open_drive(open_recording(path)), {})
    inside = (result.trajectory_stamps >= run.stamps[0]) & (result.trajectory_stamps <= run.stamps[-1])
    truth = poses_at(run, result.trajectory_stamps[inside])
    fit = rigid_fit(truth[:, :2], result.trajectory[inside][:, :2])
    if fit is None:
        raise RuntimeError("the path of the survey does not fit its truth")
    own = Site(Chart(result.landmarks, result.grid), fit.transform, vehicle, folder)
    return own, Site(reference_chart(path, run, vehicle), np.zeros(3), vehicle, folder)


def reference_chart(path: Path, run: Simulated, vehicle: Vehicle) -> Chart:
    """Return the corners mapped at poses found by surveyed reflectors, and these."""
    marks = standing_reflectors(run.circles, run.segments)
    marks = marks + np.random.default_rng(PLAN).normal(0.0, SIGMA, marks.shape)
    surveyed_marks = surveyed(np.column_stack([marks, np.full(len(marks), SIGMA)]))
    x, y, theta = run.truth[0].tolist()
    request = Request(Chart(surveyed_marks), {"mode": "reflectors"}, (x, y, theta))
    found = localize_drive(open_vehicle_drive(open_recording(path), vehicle), request)
    known = found.status != "lost"
    poses = Trajectory(found.stamps[known], found.poses[known])
    seen = survey_at(open_drive(open_recording(path), odometry="none"), poses, {}, mount=vehicle.laser)
    corners = chosen(seen.landmarks, seen.landmarks.kinds == "corner")
    return Chart(joined(corners, surveyed_marks), seen.grid)


def poses_at(run: Simulated, stamps: Array) -> Array:
    """Return the true poses (K, 3) at stamps (K,)."""
    columns = (run.truth[:, 0], run.truth[:, 1], np.unwrap(run.truth[:, 2]))
    return np.column_stack([np.interp(stamps, run.stamps, column) for column in columns])


def moved(pose: Array, poses: Array) -> Array:
    """Return the poses (K, 3) that a pose (3,) takes poses (K, 3) to."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.column_stack([poses[:, :2] @ [[c, s], [-s, c]] + pose[:2], poses[:, 2] + pose[2]])


def standing(site: Site, run: Simulated) -> Landmarks:
    """Return the map without the reflectors that do not hang."""
    hung = standing_reflectors(run.circles, run.segments)
    c, s = np.cos(site.t_world_map[2]), np.sin(site.t_world_map[2])
    here = site.chart.landmarks.positions @ [[c, s], [-s, c]] + site.t_world_map[:2]
    distance = np.linalg.norm(here[:, None] - hung, axis=2).min(axis=1, initial=np.inf)
    return chosen(site.chart.landmarks, (site.chart.landmarks.kinds == "corner") | (distance < HERE))


@dataclass(frozen=True)
class Variant:
    """A way to localize."""

    name: str
    mode: str
    kind: str | None = None
    """Landmarks of the map that are used; all when None."""
    reflectors: float = 1.0
    changed: float = MOVED


def drive(site: Site, variant: Variant, name: DriveName, seed: int) -> tuple[Localized, Array, Array]:
    """Localize a drive; with its errors (K, 3) in the frame of the vehicle, and the truth in the map."""
    run = simulate(drive_scenario(name, Day(PLAN, 1, variant.changed, variant.reflectors), seed))
    path = site.folder / "drive.mcap"
    write_recording(path, run)
    landmarks = standing(site, run)
    if variant.kind is not None:
        landmarks = chosen(landmarks, landmarks.kinds == variant.kind)
    t_map_world = relative(site.t_world_map[None], np.zeros((1, 3)))[0]
    start = moved(t_map_world, run.truth[:1])[0]
    if variant.mode == "dynamic":
        landmarks = no_landmarks()
    grid = None if variant.mode in ("dynamic", "reflectors") else site.chart.grid
    options: LocalizerOptions = {"mode": variant.mode}  # type: ignore[typeddict-item]
    drive = open_vehicle_drive(open_recording(path), site.vehicle)
    x, y, theta = start.tolist()
    result = localize_drive(drive, Request(Chart(landmarks, grid), options, (x, y, theta)))
    truth = moved(t_map_world, poses_at(run, result.stamps))
    return result, relative(truth, result.poses), truth


def nees(result: Localized, errors: Array) -> float:
    """Return the mean normalised squared error per degree of freedom."""
    values = [e @ np.linalg.solve(c, e) / 3 for e, c in zip(errors, result.covariances, strict=True)]
    return float(np.mean(values))


def halting(site: Site, variant: Variant) -> None:
    """Tell bias, scatter and mean distance at the halting points."""
    result, errors, _ = drive(site, variant, "halts", 2)
    at = [int(np.searchsorted(result.stamps, halt.to_stamp)) for halt in result.halts]
    stops = errors[at, :2]
    by_place = [stops[np.arange(len(stops)) % 10 == k] for k in range(10)]
    bias = np.mean([np.linalg.norm(e.mean(axis=0)) for e in by_place])
    scatter = np.mean([np.sqrt(e.var(axis=0, ddof=1).sum()) for e in by_place])
    distance = np.linalg.norm(stops, axis=1)
    heading = np.degrees(np.sqrt(np.mean(errors[at, 2] ** 2)))
    say(
        f"{variant.name:36} {len(stops)} halts: distance {mm(distance.mean())} mm (largest {mm(distance.max())}), bias "
        f"{mm(bias)}, scatter {mm(scatter)}, heading {heading:.3f} deg; on the way {mm(rms(errors[:, :2]))} mm, "
        f"NEES {nees(result, errors):.2f}, NIS {result.nis.sum() / result.dof.sum():.2f}, "
        f"lost {np.mean(result.status == 'lost'):.1%}, "
        f"paired {result.matched.mean():.1f} of {result.observed.mean():.1f}"
    )


def paths(site: Site, variant: Variant, runs: int) -> None:
    """Tell the errors along the four paths."""
    seeds = [(path, 100 * (k + 1) + run) for k, path in enumerate(PATHS) for run in range(1, runs + 1)]
    found = [drive(site, variant, path, seed) for path, seed in seeds]
    errors = np.vstack([e for _, e, _ in found])
    ends = np.vstack([e[-1] for _, e, _ in found])
    wrong = sum(bool(np.linalg.norm(e[len(e) // 2 :, :2], axis=1).max() > WRONG) for _, e, _ in found)
    consistency = np.mean([nees(result, e) for result, e, _ in found])
    say(
        f"{variant.name:36} {len(found)} runs: lateral {mm(rms(errors[:, 1:2]))} mm, along {mm(rms(errors[:, :1]))}, "
        f"heading {np.degrees(rms(errors[:, 2:])):.3f} deg; at the end {mm(rms(ends[:, :2]))} mm; "
        f"NEES {consistency:.2f}; {wrong} lost"
    )


def rms(errors: Array) -> float:
    """Return the root of the mean squared length of errors (K, n)."""
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=1))))


def mm(metres: float) -> str:
    """Return a length in millimetres."""
    return f"{1000 * metres:.1f}"


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main(arguments: Iterable[str]) -> None:
    """Run everything."""
    runs = int(next(iter(arguments), "6"))
    with tempfile.TemporaryDirectory() as folder:
        own, site = survey(Path(folder))
        say("halting points")
        halting(own, Variant("corners, map of groma map", "static", "corner"))
        halting(site, Variant("corners", "static", "corner"))
        halting(site, Variant("corners, a third moved", "static", "corner", changed=1 / 3))
        halting(site, Variant("reflectors", "reflectors"))
        for share in SHARES:
            halting(site, Variant(f"mixed, {share:.0%} of the reflectors", "mixed", reflectors=share))
        say("paths")
        paths(site, Variant("corners found during the drive, no map", "dynamic"), runs)
        paths(site, Variant("corners", "static", "corner"), runs)
        paths(site, Variant("corners, a third moved", "static", "corner", changed=1 / 3), runs)
        for share in SHARES:
            paths(site, Variant(f"mixed, {share:.0%} of the reflectors", "mixed", reflectors=share), runs)
        for share in SHARES[:-1]:
            paths(site, Variant(f"reflectors alone, {share:.0%}", "reflectors", reflectors=share), runs)


if __name__ == "__main__":
    main(sys.argv[1:])

"""What one scan costs on its way to a pose, called from Python as it comes.

    python benches/localize_step.py

A drive through the simulated depot (scans of 1081 beams, start known, on its reflectors and on the map of its corners):
milliseconds of CPU a scan, the best of ``TURNS`` passes, to observe it, and of the whole pipeline with the readings of
the wheels between two scans.
"""

from __future__ import annotations

import time

from localization import say

from groma.localization.drive import Request, localizing
from groma.localization.localizer import reflectors
from groma.localization.observations import Observer
from groma.nouns.maps import Chart
from groma.nouns.messages import LaserScan
from groma.simulation.localization import Day, calibrated_vehicle, drive_scenario, standing_reflectors
from groma.simulation.scenes import beam_geometry, simulate

TURNS = 5


def main() -> None:
    """Time both."""
    plan = drive_scenario("path2", Day(), 201)
    run = simulate(plan)
    g = beam_geometry(run.scenario)
    scans = [
        LaserScan(float(t), "scan", "laser", g, r, i)
        for t, r, i in zip(run.scan_stamps, run.ranges, run.intensities, strict=True)
    ]
    marks = reflectors(standing_reflectors(run.circles, run.segments), sigma=0.002)
    vehicle = calibrated_vehicle(plan, 1)
    beams = (g.angle_min, g.angle_increment, g.time_increment, g.range_min, g.range_max)
    observing, whole = [], []
    for _ in range(TURNS):
        observer, begin = Observer(), time.process_time()
        for scan in scans:
            observer.observe(scan)
        observing.append(time.process_time() - begin)
        x, y, theta = run.truth[0].tolist()
        machine = localizing(Request(Chart(marks), {}, (x, y, theta)), vehicle.laser, vehicle)
        k, begin = 0, time.process_time()
        for scan in scans:
            end = scan.stamp + (len(scan.ranges) - 1) * g.time_increment
            while k < len(run.stamps) and run.stamps[k] <= end:
                machine.push_wheels(float(run.stamps[k]), list(enumerate(run.joints[k].tolist())))
                k += 1
            machine.push_scan(scan.stamp, scan.ranges, scan.intensities, beams)
        whole.append(time.process_time() - begin)
    each = 1e3 / len(scans)
    say(f"observe {each * min(observing):.3f} ms, whole pipeline {each * min(whole):.3f} ms a scan of {len(scans)}")
    say(f"so motions and update take {each * (min(whole) - min(observing)):.3f} ms")


if __name__ == "__main__":
    main()

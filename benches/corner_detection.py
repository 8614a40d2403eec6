"""What a corner detection costs when it is called from Python.

    cargo bench --quiet -p groma-benches --bench features -- falko/361
    python benches/corner_detection.py

Microseconds of CPU a scan of 361 beams, one thread, the best of ``TURNS`` passes over 200 scans like those of the bench
of the core: one call a scan, and what the core itself took, as criterion left it.
"""

from __future__ import annotations

import json
import math
import time
from pathlib import Path

import numpy as np
from localization import say

from groma.features.corners import falko
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry

TURNS, SCANS, BEAMS = 30, 200, 361
CRITERION = Path(__file__).parents[1] / "target/criterion/200 scans/falko/361/new/estimates.json"


def hall(seed: int, geometry: BeamGeometry) -> Array:
    """Return a scan of a hall of 10 x 4 m with pillars along its walls, from another place for every seed."""
    bearing = geometry.angle_min + geometry.angle_increment * np.arange(BEAMS)
    shift, (sin, cos) = 0.01 * seed, (np.sin(bearing), np.cos(bearing))
    with np.errstate(divide="ignore"):
        wall, side = (5.0 - shift) / np.abs(cos), (2.0 + shift) / np.abs(sin)
    distance = np.minimum(wall, side)
    along = np.where(wall < side, distance * sin, distance * cos) + shift
    pillar = np.where(np.mod(along, 1.0) < 0.3, 0.3, 0.0)
    noise = 0.02 * np.random.default_rng(seed).random(BEAMS) - 0.01
    return np.asarray(distance - pillar + noise, dtype=np.float64)


def main() -> None:
    """Time the calls, beside the core where its bench was run."""
    geometry = BeamGeometry(-math.pi / 2, math.pi / (BEAMS - 1), 0.0, 0.05, 30.0)
    scans = [hall(seed, geometry) for seed in range(SCANS)]
    spent = []
    for _ in range(TURNS):
        begin = time.process_time()
        for scan in scans:
            falko(scan, geometry)
        spent.append(time.process_time() - begin)
    call = 1e6 * min(spent) / SCANS
    say(f"a call from Python {call:.1f} us")
    if CRITERION.exists():
        core = json.loads(CRITERION.read_text())["median"]["point_estimate"] / 1e3 / SCANS
        say(f"the core {core:.1f} us, ratio {call / core:.2f}")


if __name__ == "__main__":
    main()

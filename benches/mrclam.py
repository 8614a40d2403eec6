"""Localizes the robots of MR.CLAM, with landmarks told and not told, and prints the errors against motion capture.

Run as ``.venv/bin/python benches/mrclam.py FOLDER``. Wheels are calibrated against motion capture over the first two
minutes; then the truth gives the pose at the start and is compared with.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from groma.evaluation.mrclam import calibrated, localize, read_mrclam

write = sys.stdout.write
data = read_mrclam(Path(sys.argv[1]))
write("| robot | identities | RMSE [m] | median [m] | largest [m] | NEES | matched | right |\n")
write("|---|---|---|---|---|---|---|---|\n")
squares: dict[bool, list[float]] = {True: [], False: []}
for robot in data.robots:
    noise = calibrated(data.robots)
    for known in (True, False):
        drive = localize(data, robot, noise, known=known)
        errors = drive.error[np.isfinite(drive.error)]
        squares[known].append(drive.rmse)
        share = drive.right / max(drive.matched, 1)
        write(
            f"| {robot.number} | {'known' if known else 'unknown'} | {drive.rmse:.3f} | {np.median(errors):.3f} "
            f"| {errors.max():.3f} | {np.nanmedian(drive.nees):.1f} | {drive.matched} | {100 * share:.2f} % |\n"
        )
        sys.stdout.flush()
for known, values in squares.items():
    name = "known" if known else "unknown"
    write(f"\n{name} identities: RMSE {np.mean(values):.3f} m on average, {max(values):.3f} m at most\n")

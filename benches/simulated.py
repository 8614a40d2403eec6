"""Maps every simulated scene, with odometry and without, and prints the errors against the ground truth as a table.

Run as ``.venv/bin/python benches/simulated.py [SEED]``. Errors are those of `groma evaluate trajectory --relations`:
the mean over true relative poses of scans five seconds apart and of places seen again. Times are of the whole command,
report included, on the cores there are.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from groma.evaluation.relations import evaluate_relations, read_relations
from groma.io.trajectory import read_tum
from groma.simulation.scenes import scenes

GROMA = Path(sys.executable).with_name("groma")
write = sys.stdout.write


def run(*arguments: str | Path) -> float:
    """Run a command line of groma; return its time [s]. A result not to be relied on (exit code 1) is measured too."""
    start = time.perf_counter()
    ended = subprocess.run([GROMA, *arguments], capture_output=True)  # noqa: S603 (our own command)
    if ended.returncode not in (0, 1):
        raise SystemExit(ended.stderr.decode())
    return time.perf_counter() - start


def error(recording: Path, *options: str) -> str:
    """Map a recording; return mean errors and time as cells of a table."""
    out = recording.with_name("map")
    seconds = run("map", recording, "-o", out, *options)
    truth = read_relations(recording.with_name("drive.relations"))
    found = evaluate_relations(truth, read_tum(out / "trajectory.tum"))
    return f"{1e3 * found.translation.mean():.0f} mm, {found.rotation.mean():.2f} deg | {seconds:.1f} s"


write("| scene | with odometry | time | without | time |\n|---|---|---|---|---|\n")
for scene in scenes():
    with tempfile.TemporaryDirectory() as folder:
        drive = Path(folder) / "drive.mcap"
        run("simulate", scene, "-o", drive, "--seed", sys.argv[1] if len(sys.argv) > 1 else "1")
        write(f"| {scene} | {error(drive)} | {error(drive, '--odometry', 'none')} |\n")
        sys.stdout.flush()

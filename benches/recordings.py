"""Maps the public recordings beside the project and prints the errors against their relations as a table.

Run as ``.venv/bin/python benches/recordings.py DATA`` with the folder of the recordings. Relation times between two
scans are filled in from the log's own dense odometry where there is one (Intel), as the benchmark does. Times are of
the whole command, report included, and with the processor time of all threads; memory is its peak.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

GROMA = Path(sys.executable).with_name("groma")
INTEL = ("intel/derived/intel_raw3361.clf.gz", "intel/intel.relations.gz", "intel/derived/intel_rbpf_dense.tum.gz")
CSAIL = ("mit-csail/mit-csail.flaser.clf.gz", "mit-csail/csail_graph.relations.gz", None)
OTHERS = (
    "intel/derived/intel_raw910.clf.gz",
    "dpslam-loop5/loop5.log.gz",
    "radish-corrected/aces-corrected.log.gz",
    "radish-corrected/seattle-corrected.log.gz",
    "radish-corrected/edmonton-corrected.log.gz",
    "radish-corrected/orebro-corrected.log.gz",
)
write = sys.stdout.write


def mapped(recording: Path, out: Path, *options: str) -> tuple[str, str]:
    """Map a recording; return the verdict, and time and memory as cells of a table."""
    start = time.perf_counter()
    process = subprocess.Popen(  # noqa: S603 (our own command)
        [GROMA, "map", recording, "-o", out, *options], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    verdict = process.stdout.readline().strip() if process.stdout else ""
    _, status, usage = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 1):  # 1: a map, but one that must not be relied on
        raise SystemExit(f"groma map {recording}: failed")
    seconds = time.perf_counter() - start
    cost = f"{seconds:.1f} s | {usage.ru_utime + usage.ru_stime:.1f} s | {usage.ru_maxrss / 1000:.0f} MB"
    return verdict, cost


def errors(out: Path, relations: Path, fill_in: Path | None) -> str:
    """Return the figures of `groma evaluate trajectory` as cells of a table."""
    odometry = ["--odometry", fill_in] if fill_in else []
    line = [GROMA, "evaluate", "trajectory", out / "trajectory.tum", "--relations", relations, *odometry, "--json"]
    found = json.loads(subprocess.run(line, check=True, capture_output=True, text=True).stdout)  # noqa: S603
    metres, degrees = found["translation_m"], found["rotation_deg"]
    count = f"{found['relations_evaluated']} of {found['relations_total']}"
    moved = f"{metres['mean']:.3f} +- {metres['std']:.3f} m"
    return f"{moved} | {degrees['mean']:.2f} +- {degrees['std']:.2f} deg | {count}"


def main(data: Path) -> None:
    """Print both tables."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        write(
            "| recording | options | translation | rotation | relations | wall | CPU | memory |\n" + "|---" * 8 + "|\n"
        )
        for log, relations, fill_in in (INTEL, CSAIL):
            for options in ((), ("--odometry", "none"), ("--online",)):
                _, cost = mapped(data / log, out, *options)
                found = errors(out, data / relations, data / fill_in if fill_in else None)
                write(f"| `{log}` | `{' '.join(options)}` | {found} | {cost} |\n")
        write("\n| recording | verdict | wall | CPU | memory |\n" + "|---" * 5 + "|\n")
        for log in OTHERS:
            verdict, cost = mapped(data / log, out)
            write(f"| `{log}` | {verdict} | {cost} |\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

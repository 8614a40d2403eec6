"""How soon a command ends after Ctrl-C.

    python benches/interrupts.py map RECORDING -o out

The command runs once whole, then once for each of ``SHARES``, interrupted when it has used that share of the CPU of the
whole run. Printed: seconds from the signal to the end, and the exit code. Linux only: the CPU comes from /proc.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

SHARES = (0.3, 0.6, 0.9)


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def start(arguments: list[str]) -> subprocess.Popen[bytes]:
    """Start a command whose output nobody reads."""
    command = [sys.executable, "-c", "from groma.cli import main; main()", *arguments]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # noqa: S603


def cpu_of(process: subprocess.Popen[bytes]) -> float:
    """Return the CPU that a running process has used [s]."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cpu_of_children() -> float:
    """Return the CPU of all processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def interrupted(arguments: list[str], cpu: float) -> str:
    """Return what became of a command that is interrupted after so much CPU."""
    with start(arguments) as process:
        while process.poll() is None and cpu_of(process) < cpu:
            time.sleep(0.01)
        if process.poll() is not None:
            return "was done before"
        begun = time.monotonic()
        process.send_signal(signal.SIGINT)
        code = process.wait()
    return f"ended {time.monotonic() - begun:.2f} s later, exit code {code}"


def main() -> None:
    """Run the command of the command line."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job would hand on an ignored one
    arguments = sys.argv[1:]
    start(arguments).wait()
    whole = cpu_of_children()
    say(f"whole: {whole:.1f} s of CPU")
    for share in SHARES:
        say(f"interrupted at {share:.0%}: {interrupted(arguments, share * whole)}")


if __name__ == "__main__":
    main()

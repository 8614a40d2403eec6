"""Runs command lines of groma one after the other, each in a process of its own with bounds on memory and time.

A line of standard input is ``{"program": ..., "arguments": [...], "folder": ...}``, the program a module with a
function ``run``; a line of standard output what came of it: exit code (negative: the signal that ended it), seconds of
work, peak memory [MB], what it said on standard error. The package is imported once; a command runs in a fork of the
process, which has no threads.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import traceback
from importlib import import_module
from pathlib import Path

SECONDS = 20
"""Of the processor, so that a busy machine changes nothing; of the clock five times as much."""
ADDRESS_SPACE = 3 << 30


def child(program: str, arguments: list[str], folder: Path) -> None:
    """Run one command line; does not return."""
    log = os.open(folder / "stderr.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.chdir(folder)
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    signal.alarm(5 * SECONDS)
    code = 1
    try:
        code = import_module(program).run(arguments)
    except BaseException:
        traceback.print_exc()
    sys.stderr.flush()
    os._exit(code)


def outcome(request: dict[str, object]) -> dict[str, object]:
    """Run one request and say what came of it."""
    folder, arguments = Path(str(request["folder"])), request["arguments"]
    assert isinstance(arguments, list)
    pid = os.fork()
    if pid == 0:
        child(str(request["program"]), arguments, folder)
    _, status, usage = os.wait4(pid, 0)
    said = (folder / "stderr.txt").read_text(errors="replace")
    return {
        "code": os.waitstatus_to_exitcode(status),
        "seconds": usage.ru_utime + usage.ru_stime,
        "megabytes": usage.ru_maxrss / 1024,
        "said": said[-3000:],
    }


def main() -> None:
    """Answer line by line."""
    for place in sys.argv[1:]:
        import_module(place)
    for line in sys.stdin:
        sys.stdout.write(json.dumps(outcome(json.loads(line))) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()

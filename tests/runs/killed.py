"""Interrupts a run at each of its file operations in turn, and looks at what is left: a script, for it forks.

    python killed.py FOLDER HOW [COMMAND ...]

HOW is kill, interrupt, terminate, twice (two signals) or full (from then on nothing can be written any more); `-link`
behind it lets no two names be exchanged. Without a COMMAND of groma a prepared result is written, and every operation
is tried; with one, every seventh. Prints the number of cases, and what was wrong in any.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
import signal
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import groma.cli
from groma.errors import UserError
from groma.runs import exchange
from groma.runs.run import Run

FILE_EVENTS = {"open", "os.mkdir", "os.rename", "os.rmdir", "os.remove", "os.symlink", "os.chmod", "os.scandir"}
GROWING = {"open", "os.mkdir", "os.symlink", "write"}
"""What a full disk refuses."""
STEP = 7


class Interposed:
    """Counts the file operations below a folder, and acts at one of them."""

    def __init__(self, folder: Path, at: int, act: Callable[[str], None]) -> None:
        self.folder, self.at, self.act, self.count = str(folder), at, act, 0

    def install(self) -> None:
        sys.addaudithook(self._hear)
        before = os.fdopen

        def fdopen(handle: int, *arguments: Any) -> IO[Any]:
            file = before(handle, *arguments)
            write = file.write

            class Counted:
                def __enter__(self) -> Counted:
                    return self

                def __exit__(self, *_: object) -> None:
                    file.close()

                def __getattr__(self, name: str) -> object:
                    return getattr(file, name)

                def write(inner, data: bytes) -> int:  # noqa: N805
                    self.step("write")
                    return int(write(data))

            return Counted()  # type: ignore[return-value]

        os.fdopen = fdopen  # type: ignore[assignment]
        swap = exchange.exchange
        exchange.exchange = lambda a, b: (self.step("exchange"), swap(a, b))[1]  # type: ignore[func-returns-value]

    def _hear(self, event: str, arguments: tuple[object, ...]) -> None:
        if event in FILE_EVENTS and arguments and self.folder in str(arguments[0]):
            if event == "open" and isinstance(arguments[2], int) and not arguments[2] & (os.O_WRONLY | os.O_RDWR):
                return
            self.step(event)

    def step(self, event: str) -> None:
        self.count += 1
        if self.count >= self.at:
            self.act(event)


def actor(how: str, at: list[int]) -> Callable[[str], None]:
    """Return what happens at the operation."""

    def full(event: str) -> None:
        if event in GROWING:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def signals(*numbers: int) -> Callable[[str], None]:
        def act(_: str) -> None:
            if not at:
                at.append(1)
                for number in numbers:
                    os.kill(os.getpid(), number)
                    time.sleep(0.002)

        return act

    return {
        "full": full,
        "kill": signals(signal.SIGKILL),
        "interrupt": signals(signal.SIGINT),
        "terminate": signals(signal.SIGTERM),
        "twice": signals(signal.SIGTERM, signal.SIGTERM),
    }[how]


def write(output: Path, text: str) -> int:
    """Leave a prepared result and return the exit code."""
    try:
        with Run("map", "map", output, command="") as run:
            for name in ("a.csv", "deep/b.csv", "c.csv"):
                run.write_text(name, text)
            run.finish({"text": text}, text)
    except UserError:
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


def forked(work: Callable[[], int]) -> int:
    """Return how a child ended that does some work in silence."""
    child = os.fork()
    if child == 0:
        code = 99
        try:
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                code = work()
        finally:
            os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def state(output: Path) -> tuple[str, ...] | None:
    """Return the content of a folder if it is whole: the files that its record lists and no others."""
    if not output.exists():
        return None
    names = sorted(path.relative_to(output).as_posix() for path in output.rglob("*") if path.is_file())
    assert names == tomllib.loads((output / "run.toml").read_text())["files"], names
    assert (output / "report.html").read_text().rstrip().endswith("</html>")
    return tuple((output / name).read_text(errors="replace") for name in names if name.endswith((".csv", ".tum")))


def case(folder: Path, how: str, at: int, work: Callable[[Path], int], used: bool) -> tuple[bool, str]:
    """Return whether the operation was reached, and what is wrong."""
    folder.mkdir()
    output = folder / "out"
    if used:
        forked(lambda: write(output, "old"))
    before = state(output)
    reached = folder.parent / "reached"

    def interposed() -> int:
        hook = Interposed(folder, at, actor(how, []))
        hook.install()
        code = work(output)
        if hook.count >= at:
            reached.touch()
        return code

    code = forked(interposed)
    was_reached = reached.exists() or code < 0 or code in (130, 143)
    wrong = ""
    try:
        after = state(output)
        if how == "full" and after == before:
            wrong = "" if code == 2 or not was_reached else f"exit code {code}"
        elif how in ("kill", "twice"):
            wrong = "" if code in (0, -9, 130, 143) else f"exit code {code}"
        elif code not in (0, 2, 130):
            wrong = f"exit code {code}"
        if after not in (before, after if after and "old" not in after else before):
            wrong = "a mixture"
        if forked(lambda: write(output, "next")) != 0 or state(output) != ("next",) * 3:
            wrong = "the next run fails"
        left = {path.name for path in folder.iterdir()} - {"out"}
        if len(left) > (1 if output.is_symlink() else 0):
            wrong = f"left behind: {left}"
    except AssertionError as error:
        wrong = f"not whole: {error}"
    shutil.rmtree(folder)
    reached.unlink(missing_ok=True)
    return was_reached, wrong


def main(root: Path, how: str, command: list[str]) -> int:
    """Run all cases and return the number of those that were wrong."""
    how, _, mode = how.partition("-")
    if mode == "link":
        exchange.exchange = lambda *_: False
    step = STEP if command else 1

    def work(output: Path) -> int:
        return groma.cli.run([*command, "-o", str(output)]) if command else write(output, "new")

    cases = failures = 0
    for used in (False, True):
        at, reached = 1, True
        while reached:
            reached, wrong = case(root / f"case{cases}", how, at, work, used)
            cases, at = cases + 1, at + step
            if wrong:
                failures += 1
                sys.stdout.write(f"{how} at {at - step}, {'used' if used else 'fresh'}: {wrong}\n")
    sys.stdout.write(f"{cases} cases\n")
    return failures


if __name__ == "__main__":
    sys.exit(min(main(Path(sys.argv[1]), sys.argv[2], sys.argv[3:]), 1))

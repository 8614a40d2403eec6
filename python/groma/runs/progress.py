"""Progress of a run on standard error: how much is done, how fast, how long it will take. Only on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

Show = Callable[..., None]
"""Called as ``show(done, state="", total=None)``; states are words."""

PERIOD = 0.1
"""Time between two changes of what is shown [s]."""


@contextmanager
def stage(unit: str, total: int | None = None) -> Iterator[Show]:
    """Show the progress of a stage while it lasts.

    Parameters
    ----------
    unit
        What is counted, in the plural.
    total
        How many there are; None when nobody knows.
    """
    console = Console(stderr=True)
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}", markup=False), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(unit, total=total)
        begin, last = monotonic(), 0.0

        def show(done: int, state: str = "", total: int | None = total) -> None:
            nonlocal last
            now = monotonic()
            if progress.disable or now - last < PERIOD:
                return
            last = now
            rate = done / max(now - begin, PERIOD)
            words = f"{unit}, {rate:.0f}/s" if rate >= 1 else unit
            progress.update(task, completed=done, total=total, description=f"{words}, {state}" if state else words)

        yield show

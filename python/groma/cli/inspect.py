"""`groma inspect`: what is in a recording, and what it is good for."""

from __future__ import annotations

import json as json_text
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from groma.io.recording import Recording, open_recording
from groma.recordings.inspection import Inspection
from groma.recordings.inspection import inspect as run
from groma.report.inspection import Section, as_json, sections


def inspect(file: Path, /, *, json: bool = False) -> None:
    """Tell what is in a recording: streams, rates, gaps, beams, odometry, frames, and which commands it can serve.

    groma inspect drive.mcap

    Parameters
    ----------
    file
        CARMEN or DP-SLAM log (also .gz), ROS 1 bag, ROS 2 bag (folder, .mcap or .db3) or groma CSV.
    json
        Print JSON with stable keys instead of tables.
    """
    found = _with_progress(open_recording(file))
    if json:
        print(json_text.dumps(as_json(found), indent=1, allow_nan=False))
    elif sys.stdout.isatty():
        _print_rich(found)
    else:
        for section in sections(found):
            print("\n".join(_plain(section)))


def _with_progress(recording: Recording) -> Inspection:
    """Count messages on a terminal while reading; silent otherwise."""
    known = [stream.count for stream in recording.streams]
    total = sum(count or 0 for count in known) if None not in known else None
    of = f" of about {total}" if total else ""
    console = Console(stderr=True)
    columns = (SpinnerColumn(), TextColumn("{task.completed:.0f}" + of + " messages"), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("read")
        return run(recording, lambda count: progress.update(task, completed=count))


def _print_rich(found: Inspection) -> None:
    console = Console(highlight=False)
    for section in sections(found):
        console.print(Text(section.title, style="bold"))
        if section.rows:
            table = Table(*section.rows[0], box=None, pad_edge=False, header_style="dim")
            for row in section.rows[1:]:
                table.add_row(*map(Text, row))
            console.print(table)
        for sentence in section.sentences:
            console.print(Text(f"  {sentence}"))
        console.print()


def _plain(section: Section) -> list[str]:
    lines = [section.title, *(f"  {sentence}" for sentence in section.sentences)]
    if section.rows:
        widths = [max(map(len, column)) for column in zip(*section.rows, strict=True)]
        lines += [
            "  " + "  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in section.rows
        ]
    return [*lines, ""]

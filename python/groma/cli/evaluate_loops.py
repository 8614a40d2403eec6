"""`groma evaluate loops`: how many returns to known places are found by corners, and how many found are right."""

from __future__ import annotations

import json as json_text
import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.evaluation.feature_scans import read_posed_scans, tell_notes
from groma.evaluation.loops import LoopEvaluation, evaluate_loops
from groma.io.atomic import write_text
from groma.io.results import result_directory
from groma.report.loop_report import loop_figures, loop_report, loop_tables


def loops(
    *logs: Path,
    poses: Path | None = None,
    json: bool = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Say how many returns to known places are found by corners, and how many of the places found are right.

    Places are found from the scans alone; the poses only judge. The protocol is in docs/theory/loop_evaluation.md.

    groma evaluate loops return.mcap

    groma evaluate loops return.mcap -o out

    Parameters
    ----------
    logs
        What `groma inspect` can read.
    poses
        Poses of the vehicle, TUM, for a log whose own odometry drifts.
    json
        Print all figures as JSON.
    output
        Folder for loops.json and loops.html, a page with the curves.
    """
    if not logs:
        raise UserError("give at least one recording")
    if poses is not None and len(logs) > 1:
        raise UserError(f"--poses is for one recording, not for {len(logs)}: evaluate them one by one")
    found = [_evaluated(log, poses) for log in logs]
    text = json_text.dumps(loop_figures(found), indent=2, allow_nan=False)
    if output is not None:
        directory = result_directory(output, datetime.now().astimezone())
        write_text(directory / "loops.json", text + "\n")
        write_text(directory / "loops.html", loop_report(found))
    print(text if json else loop_tables(found))


def _evaluated(log: Path, poses: Path | None) -> LoopEvaluation:
    scans = read_posed_scans(log, poses, 1)
    for line in tell_notes(scans):
        print(line, file=sys.stderr)
    return evaluate_loops(scans)

"""`groma evaluate loops`: how many returns to known places are found by corners, and how many found are right."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.evaluation.loops import evaluate_loops
from groma.nouns.findings import Finding
from groma.report.loops.report import loop_figures, loop_report, loop_tables
from groma.report.words import count
from groma.runs.evaluation import check_recordings, evaluated
from groma.runs.run import Run


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
        Folder for figures and a page with the curves; none when left out.
    """
    check_recordings(logs, poses)
    with Run("evaluation", "evaluate loops", output, folder=output is not None) as run:
        if poses is None:
            run.note(Finding("reference-drifts", "places are judged by the odometry of the recording"))
        found = evaluated(run, logs, poses, 1, evaluate_loops)
        run.say(loop_tables(found))
        headline = f"Loop closure by corners in {count(len(found), 'recording')}."
        run.finish(loop_figures(found), headline, lambda outcome: loop_report(found, outcome), as_json=json)

"""`groma evaluate features`: how repeatable the corners of recordings are, how many, how short-lived."""

from __future__ import annotations

import json as json_text
import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.evaluation.feature_scans import read_posed_scans, tell_notes
from groma.evaluation.features import FeatureEvaluation, evaluate_features
from groma.io.atomic import write_text
from groma.io.results import result_directory
from groma.report.feature_report import feature_figures, feature_report, feature_tables


def features(
    *logs: Path,
    poses: Path | None = None,
    every: int = 3,
    json: bool = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
) -> None:
    """Say how repeatable FALKO corners are, raw and beyond chance, how many there are, and how many are seen only once.

    The protocol is in docs/theory/feature_evaluation.md.

    groma evaluate features drive.mcap

    groma evaluate features drive.mcap --poses results/latest/trajectory.tum -o out

    Parameters
    ----------
    logs
        What `groma inspect` can read.
    poses
        Poses of the vehicle, TUM, for a log whose own odometry drifts.
    every
        Look at every n-th scan.
    json
        Print all figures as JSON.
    output
        Folder for features.json and features.html, a page with the curves.
    """
    if not logs:
        raise UserError("give at least one recording")
    if poses is not None and len(logs) > 1:
        raise UserError(f"--poses is for one recording, not for {len(logs)}: evaluate them one by one")
    if every < 1:
        raise UserError(f"--every {every}: must be at least 1")
    found = [_evaluated(log, poses, every) for log in logs]
    text = json_text.dumps(feature_figures(found, every), indent=2, allow_nan=False)
    if output is not None:
        directory = result_directory(output, datetime.now().astimezone())
        write_text(directory / "features.json", text + "\n")
        write_text(directory / "features.html", feature_report(found, every))
    print(text if json else feature_tables(found))


def _evaluated(log: Path, poses: Path | None, every: int) -> FeatureEvaluation:
    scans = read_posed_scans(log, poses, every)
    for line in tell_notes(scans):
        print(line, file=sys.stderr)
    return evaluate_features(scans)

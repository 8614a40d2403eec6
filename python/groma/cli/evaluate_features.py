"""`groma evaluate features`: how repeatable the corners of recordings are, how many, how short-lived."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.errors import UserError
from groma.evaluation.features import evaluate_features
from groma.report.features.report import feature_figures, feature_report, feature_tables
from groma.report.words import count
from groma.runs.evaluation import check_recordings, evaluated
from groma.runs.run import Run
from groma.runs.tables import settings_of


def features(
    *logs: Path,
    poses: Path | None = None,
    every: int | None = None,
    json: bool = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
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
        Look at every n-th scan; every third when left out.
    json
        Print all figures as JSON.
    output
        Folder for figures and a page with the curves; none when left out.
    config
        TOML with a table [features] (groma config prints it) or the run.toml of another run.
    """
    check_recordings(logs, poses)
    settings = settings_of("features", config, every=every)
    thinned = int(str(settings["every"]))
    if thinned < 1:
        raise UserError(f"--every {thinned}: must be at least 1")
    with Run("evaluation", "evaluate features", output, folder=output is not None) as run:
        run.settings = {"features": settings}
        found = evaluated(run, logs, poses, thinned, evaluate_features)
        run.say(feature_tables(found))
        headline = f"Repeatability of FALKO corners in {count(len(found), 'recording')}."
        figures = feature_figures(found, thinned)
        run.finish(figures, headline, lambda outcome: feature_report(found, thinned, outcome), as_json=json)

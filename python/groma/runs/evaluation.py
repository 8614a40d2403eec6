"""Runs that evaluate corners on recordings with poses: what they have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from groma.errors import UserError
from groma.evaluation.feature_scans import PosedScans, read_posed_scans
from groma.runs.run import Run

T = TypeVar("T")


def evaluated(
    run: Run, logs: Sequence[Path], poses: Path | None, every: int, evaluate: Callable[[PosedScans], T]
) -> list[T]:
    """Return the evaluation of each recording; findings bear its name.

    Raises
    ------
    UserError
        When there is no recording, or one has no poses.
    """
    if poses is not None:
        run.inputs["poses"] = poses
    found = []
    for number, log in enumerate(logs):
        recording = run.open(log, "input" if number == 0 else f"input_{number + 1}")
        scans = read_posed_scans(recording, poses, every)
        run.extend(replace(finding, text=f"{log.name}: {finding.text}") for finding in scans.findings)
        found.append(evaluate(scans))
    return found


def check_recordings(logs: Sequence[Path], poses: Path | None) -> None:
    """Refuse no recording at all, and poses for several.

    Raises
    ------
    UserError
        In one line.
    """
    if not logs:
        raise UserError("give at least one recording")
    if poses is not None and len(logs) > 1:
        raise UserError(f"--poses is for one recording, not for {len(logs)}: evaluate them one by one")

"""The run of drives tried out before a camera, into the folder of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from groma.evaluation.motions import Varied, study, try_motions
from groma.nouns.camera import Camera
from groma.planning.camera import Stage, Tried, Tries
from groma.report.motions.report import motions_report, motions_verdict, shares
from groma.report.words import short
from groma.runs.run import Run


def try_motions_into(run: Run, stage: Stage, distance: float, tries: Tries, *, errors: bool) -> None:
    """Try common trajectories, also the error study where wanted; finish the run with them."""
    with run.stage("drives") as show:
        tried = try_motions(stage, distance, tries, lambda done, total: show(done, total=total), run.token)
    studied: list[Varied] = []
    if errors:
        with run.stage("errors studied") as show:
            studied = study(tries, lambda done, total: show(done, total=total), run.token)
    for motion, found in tried.items():
        named = shares(stage.camera, found, found.deviation).items()
        told = "  ".join(f"{name} {short(share)} %" for name, share in named)
        run.say(f"{motion:13} {told or 'refused: ' + (found.reason or '')}")
    figures = _figures(stage.camera, tried, studied)
    headline = motions_verdict(tried, tries.runs)
    run.finish(figures, headline, lambda out: motions_report(stage.camera, tried, studied, tries.runs, out))


def _figures(camera: Camera, tried: Mapping[str, Tried], studied: Sequence[Varied]) -> dict[str, object]:
    return {
        "parameters": list(camera.names),
        "motions": {motion: msgspec.to_builtins(found) for motion, found in tried.items()},
        "errors": [{"varied": p.what, "value": p.value, **msgspec.to_builtins(p.found)} for p in studied],
    }

"""`groma demo`: a simulated warehouse from the recording to the map, and how far the map is from the truth."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.cli.map import map_into
from groma.cli.simulate import simulate
from groma.errors import EstimationError
from groma.evaluation.relations import RelationErrors, evaluate_relations, read_relations
from groma.inspection import Inspection, inspect
from groma.io.drive import open_drive
from groma.io.recording import open_recording
from groma.io.results import point_latest, result_directory, shown_command
from groma.io.trajectory import read_tum
from groma.mapper import map_defaults
from groma.report.inspection_text import sections
from groma.report.words import verdict

SEED = 1


def demo(*, output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None) -> None:
    """Simulate a warehouse, map it, compare the map with the truth: the first command to try.

    groma demo

    groma demo -o warehouse-map

    Parameters
    ----------
    output
        Folder for the recording and the results; a new one in results/ when left out.
    """
    directory = result_directory(output, datetime.now().astimezone())
    recording = directory / "warehouse.mcap"
    simulate("warehouse", output=recording, seed=SEED)
    for line in _summary(inspect(open_recording(recording))):
        print(line)
    result = map_into(
        directory, open_drive(open_recording(recording)), map_defaults(), shown_command(["map", recording.name])
    )
    if output is None:
        point_latest(directory)
    print(verdict(result))
    print(_accuracy(_compare(directory)))
    print(f"look at {directory / 'report.html'}; then, for a recording of your own: groma map FILE")


def _summary(found: Inspection) -> list[str]:
    """Return the head of what `groma inspect` says, and what it would map."""
    streams = [f"{timing.count} {kind} on {name}" for (name, kind), timing in found.timings.items()]
    return [next(sections(found)).title, f"  {', '.join(streams)}", *(f"  {line}" for line in found.drive)]


def _compare(directory: Path) -> RelationErrors:
    """Compare the trajectory that was written with the true relations that the simulation wrote."""
    truth = read_relations(directory / "warehouse.relations")
    errors = evaluate_relations(truth, read_tum(directory / "trajectory.tum"))
    if not len(errors.translation):
        raise EstimationError(f"{directory}: too little was mapped to be compared with the truth")
    return errors


def _accuracy(errors: RelationErrors) -> str:
    """Return the mean errors as one sentence."""
    metres, degrees = errors.translation.mean(), errors.rotation.mean()
    count = len(errors.translation)
    return (
        f"Measured against the truth: {metres:.3f} m and {degrees:.2f} deg in the mean of {count} true relative poses."
    )

"""The part of a demonstration that maps: a simulated warehouse, compared with its ground truth."""

from __future__ import annotations

from pathlib import Path

from groma.cli.simulate import simulate
from groma.errors import EstimationError
from groma.evaluation.relations import RelationErrors, evaluate_relations, read_relations
from groma.io.trajectory import read_tum
from groma.mapping.mapper import map_defaults
from groma.mapping.result import MapResult
from groma.recordings.drive import open_drive
from groma.report.map.words import verdict
from groma.runs.map import map_into
from groma.runs.record import shown_command
from groma.runs.run import Run


def map_simulated(whole: Run, recordings: Path, seed: int) -> tuple[MapResult, list[str]]:
    """Simulate a warehouse, map it into a folder, and say how far that is from the truth.

    Parameters
    ----------
    whole
        The run of the demonstration; its folder gets the folder ``map``, as `groma map` makes it.
    recordings
        Folder for ``warehouse.mcap`` with its truth.
    seed
        Draws the building and all noise.

    Returns
    -------
    tuple
        The map, and lines for a person.
    """
    recording, folder = recordings / "warehouse.mcap", whole.folder / "map"
    simulate("warehouse", output=recording, seed=seed)
    with Run("map", "map", folder, command=shown_command(["map", recording.name]), within=whole) as run:
        result = map_into(run, open_drive(run.open(recording)), map_defaults())
    return result, [verdict(result), _accuracy(_compare(folder, recordings))]


def _compare(folder: Path, recordings: Path) -> RelationErrors:
    """Compare the trajectory that was written with the true relations that the simulation wrote."""
    truth = read_relations(recordings / "warehouse.relations")
    errors = evaluate_relations(truth, read_tum(folder / "trajectory.tum"))
    if not len(errors.translation):
        raise EstimationError(f"{folder}: too little was mapped to be compared with the truth")
    return errors


def _accuracy(errors: RelationErrors) -> str:
    """Return the mean errors as one sentence."""
    metres, degrees = errors.translation.mean(), errors.rotation.mean()
    count = len(errors.translation)
    return f"Mean error of {count} relative poses against the ground truth: {metres:.3f} m and {degrees:.2f} deg."

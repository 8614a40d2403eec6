"""The part of a demonstration that maps: a simulated warehouse, from recording to map, held against its truth."""

from __future__ import annotations

from pathlib import Path

from groma.cli.map import map_into
from groma.cli.simulate import simulate
from groma.errors import EstimationError
from groma.evaluation.relations import RelationErrors, evaluate_relations, read_relations
from groma.io.drive import open_drive
from groma.io.recording import open_recording
from groma.io.results import shown_command
from groma.io.trajectory import read_tum
from groma.mapper import map_defaults
from groma.mapping import MapResult
from groma.report.words import verdict


def map_simulated(directory: Path, seed: int) -> tuple[MapResult, list[str]]:
    """Simulate a warehouse, map it into a folder, and say how far that is from the truth.

    Parameters
    ----------
    directory
        Exists; gets ``warehouse.mcap`` with its truth, and the files of `groma map`.
    seed
        Draws the building and all noise.

    Returns
    -------
    tuple
        The map, and lines for a person.
    """
    recording = directory / "warehouse.mcap"
    simulate("warehouse", output=recording, seed=seed)
    drive = open_drive(open_recording(recording))
    result = map_into(directory, drive, map_defaults(), shown_command(["map", recording.name]))
    return result, [verdict(result), _accuracy(_compare(directory))]


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

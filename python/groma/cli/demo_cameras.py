"""The part of a demonstration that maps cameras: a hallway of 50 m whose cameras never share a view."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groma.cameras.survey import open_network, write_network
from groma.nouns.network import NetworkMap
from groma.report.network.figures import current
from groma.report.network.words import network_verdict
from groma.runs.network import map_network_into
from groma.runs.record import shown_command
from groma.runs.run import Run
from groma.simulation.network import SimulatedNetwork, network_scene, simulate_network


def map_simulated_cameras(whole: Run, recordings: Path, seed: int) -> tuple[NetworkMap, list[str]]:
    """Simulate a survey of the hallway, map its cameras into a folder, and say how far that is from the truth.

    Parameters
    ----------
    whole
        The run of the demonstration; its folder gets the folder ``cameras``, as `groma cameras map` makes it.
    recordings
        Folder for the survey.
    seed
        Draws all noise.

    Returns
    -------
    tuple
        The map, and lines for a person.
    """
    simulated = simulate_network(network_scene("hallway", seed))
    survey = recordings / "survey"
    write_network(survey, simulated.scene.target, simulated.scene.known(), simulated.messages())
    command = shown_command(["cameras", "map", "survey"])
    with Run("network", "cameras map", whole.folder / "cameras", command=command, within=whole) as run:
        network = map_network_into(run, open_network(survey), simulated.scene.settings())
    return network, [network_verdict(network), _accuracy(network, simulated)]


def _accuracy(network: NetworkMap, simulated: SimulatedNetwork) -> str:
    """Return the errors against the ground truth as one sentence."""
    truth = {camera.name: pose for camera, pose in zip(simulated.scene.cameras, simulated.cameras, strict=True)}
    off = [float(np.linalg.norm(camera.pose[:3] - truth[camera.name][:3])) for camera in current(network)]
    odometry = float(np.linalg.norm(network.odometry[-1, :2] - simulated.stops[-1, :2]))
    return (
        f"Error against the ground truth: cameras {1000 * max(off):.0f} mm at most, "
        f"where odometry alone ends {odometry:.2f} m off."
    )

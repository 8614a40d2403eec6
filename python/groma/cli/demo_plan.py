"""The part of a demonstration that plans: the drive through a building whose cameras are not known yet."""

from __future__ import annotations

from pathlib import Path

from groma.cli.evaluate_exploration import compared, save
from groma.cli.plan_exploration import plan_into
from groma.exploration import Settings
from groma.exploration import scene as draw
from groma.io.results import run_record

LAMBDAS = (10.0, 100.0, 1000.0)
PLANS = ("drive/report.html", "strategies/report.html")


def plan_simulated(directory: Path, seed: int) -> tuple[None, list[str]]:
    """Plan the drive through a building of 16 cameras, and compare all strategies there.

    Parameters
    ----------
    directory
        Exists; gets the folders ``drive`` (`groma plan exploration`) and ``strategies`` (`groma evaluate exploration`).
    seed
        Draws the building.

    Returns
    -------
    tuple
        Nothing, and lines for a person.
    """
    building = draw("sparse", seed=seed)
    drive, strategies = (directory / Path(name).parent for name in PLANS)
    for folder in (drive, strategies):
        folder.mkdir(exist_ok=True)
    told = plan_into(drive, building, Settings(), {"scene": "sparse"}, frames=True)
    record = run_record({"exploration": {"scene": "sparse", "lambdas": list(LAMBDAS)}}, None, None)
    save(strategies, *compared([building], LAMBDAS), 1, record)
    return None, [told]

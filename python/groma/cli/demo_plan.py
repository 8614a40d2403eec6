"""The part of a demonstration that plans: the drive through a building whose cameras are not known yet."""

from __future__ import annotations

from pathlib import Path

from groma.planning.building import Building
from groma.planning.exploration import Settings
from groma.planning.exploration import scene as draw
from groma.runs.exploration import compare_into, plan_into
from groma.runs.run import Run

LAMBDAS = (10.0, 100.0, 1000.0)
PLANS = ("drive/report.html", "strategies/report.html")
TITLES = ("plan exploration", "evaluate exploration")


def plan_simulated(whole: Run, recordings: Path, seed: int) -> tuple[None, list[str]]:  # noqa: ARG001
    """Plan the drive through a building of 16 cameras, and compare all strategies there.

    Parameters
    ----------
    whole
        The run of the demonstration; its folder gets the folders ``drive`` (`groma plan exploration`) and
        ``strategies`` (`groma evaluate exploration`).
    recordings
        Nothing is recorded for it.
    seed
        Draws the building.

    Returns
    -------
    tuple
        Nothing, and lines for a person.
    """
    building = draw("sparse", seed=seed)
    drive, strategies = (whole.folder / Path(name).parent for name in PLANS)
    with Run("plan", TITLES[0], drive, command="", within=whole) as run:
        told = plan_into(run, Building(building), Settings(), {"scene": "sparse", "seed": seed}, frames=True)
    with Run("evaluation", TITLES[1], strategies, command="", within=whole) as run:
        compare_into(run, [building], LAMBDAS)
    return None, [told]

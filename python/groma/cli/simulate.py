"""`groma simulate`: a recording of a building that does not exist, with the truth beside it.

`groma simulate SCENE` is the verb itself; what is simulated for one purpose (a calibration, ...) is a verb below it,
in a file of its own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import App, Parameter

from groma.cli.parameters import PLAIN
from groma.cli.simulated import recording_stem, seed_of
from groma.io.recording import write_recording
from groma.io.trajectory import write_tum
from groma.runs.tables import settings_of
from groma.simulation.scenes import Simulated, scenario, true_relations, write_relations
from groma.simulation.scenes import simulate as run

Scene = Literal["rooms", "warehouse", "loop", "stalls", "turns", "depot"]

app = App(name="simulate", default_parameter=PLAIN)
for verb in ("cameras", "localization", "vehicle"):
    app.command(f"groma.cli.simulate_{verb}:{verb}", name=verb)


@app.default
def simulate(
    scene: Scene,
    /,
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    seed: int | None = None,
    config: Path | None = None,
) -> None:
    """Simulate a drive: writes FILE, FILE-truth.tum and FILE.relations (FILE without its suffix).

    groma simulate rooms -o rooms.mcap

    Parameters
    ----------
    scene
        rooms: an office floor, a scan every 0.2 s. warehouse: racks, pallets, reflectors, a tricycle, moving sweeps.
        loop: 2 km of corridor, a scan every 2 s, odometry that ends 30 m off. stalls: rooms, with odometry that
        stands still for a second and then jumps. turns: rooms, with turns of 40 degrees and more between scans.
        depot: the warehouse with more reflectors and a finer scanner.
    output
        Recording to write: .csv, .csv.gz or .mcap.
    seed
        Draws the building and all noise; 1 when left out.
    config
        TOML with a table [simulate] (groma config prints it).
    """
    stem = recording_stem(output)
    drawn = seed_of(settings_of("simulate", config, seed=seed))
    simulated = run(scenario(scene, drawn))
    write_recording(output, simulated)
    write_tum(stem.with_name(stem.name + "-truth.tum"), simulated.stamps, simulated.truth)
    relations = true_relations(simulated.scan_stamps, simulated.scan_truth)
    write_relations(stem.with_name(stem.name + ".relations"), relations)
    print(f"{output.name}: {_summary(simulated)}, {len(relations.times)} relations, seed {drawn}")


def _summary(simulated: Simulated) -> str:
    steps = np.diff(simulated.truth[:, :2], axis=0)
    length, time = np.hypot(*steps.T).sum(), simulated.stamps[-1] - simulated.stamps[0]
    return f"{len(simulated.scan_stamps)} scans, {length:.0f} m in {time:.0f} s"

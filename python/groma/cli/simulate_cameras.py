"""`groma simulate cameras`: a survey of a camera network that does not exist, with the truth beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.network_recording import write_network
from groma.io.toml import to_toml
from groma.network_simulation import SimulatedNetwork, network_scene, simulate_network

Scene = Literal["corridor", "loop", "laps", "hallway"]


def cameras(scene: Scene, /, *, output: Annotated[Path, Parameter(alias="-o")], seed: int = 1) -> None:
    """Simulate a survey of cameras: writes a folder that `groma cameras map` takes, truth and settings in it.

    groma simulate cameras hallway -o survey

    groma cameras map survey --config survey/settings.toml

    Parameters
    ----------
    scene
        corridor: 50 m one way, seven cameras. loop, laps: a loop of 50 m, eight cameras, once and three times.
        hallway: 50 m of hallways in a loop, seven cameras, seven times, with better wheels.
    output
        Folder to write.
    seed
        Draws all noise.
    """
    if seed < 0:
        raise UserError(f"--seed {seed}: must be at least 0")
    simulated = simulate_network(network_scene(scene, seed))
    known = simulated.scene.known()
    write_network(output, simulated.scene.target, known, simulated.messages())
    write_text(output / "truth.json", _truth(simulated))
    write_text(output / "settings.toml", to_toml({"cameras": simulated.scene.settings()}))
    stops, seen = len(simulated.stops), len(simulated.detections)
    print(f"{output}: {len(known)} cameras, {stops} stops, {seen} panels seen, seed {seed}")


def _truth(simulated: SimulatedNetwork) -> str:
    """Return the true poses, in the frame of the map."""
    cameras = {
        camera.name: {"position": pose[:3].tolist(), "quaternion": pose[3:].tolist(), "parameters": lens.parameters}
        for camera, pose, lens in zip(simulated.scene.cameras, simulated.cameras, simulated.lenses, strict=True)
    }
    content = {"cameras": cameras, "mount": simulated.mount.tolist(), "stops": simulated.stops.tolist()}
    return json.dumps(content, indent=1) + "\n"

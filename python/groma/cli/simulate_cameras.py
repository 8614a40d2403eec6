"""`groma simulate cameras`: a survey of a camera network that does not exist, with the truth beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from PIL import Image

from groma.cameras.survey import write_network
from groma.cli.simulated import seed_of
from groma.io.atomic import replacing
from groma.io.toml import to_toml
from groma.nouns.arrays import Gray
from groma.runs.run import Run
from groma.runs.tables import settings_of
from groma.simulation.network import SimulatedNetwork, network_scene, simulate_network
from groma.simulation.rendered_network import Keep, rendered_messages

Scene = Literal["corridor", "loop", "laps", "hallway"]


def cameras(
    scene: Scene,
    /,
    *,
    output: Annotated[Path, Parameter(alias="-o")],
    seed: int | None = None,
    images: bool = False,
    config: Path | None = None,
) -> None:
    """Simulate a survey of cameras: writes a folder that `groma cameras map` takes, truth and settings in it.

    groma simulate cameras hallway -o survey

    groma cameras map survey --config survey/settings.toml

    Parameters
    ----------
    scene
        corridor: 50 m one way, seven cameras. loop, laps: a loop of 50 m, eight cameras, once and three times.
        hallway: 50 m of hallways in a loop, seven cameras, ten times, with better wheels.
    output
        Folder to write.
    seed
        Draws all noise; 1 when left out.
    images
        Let the cameras take images, with lens, blur and noise, and find the corners in them by the real detector; they
        are written to images/CAMERA/STOP.png. Takes minutes instead of seconds.
    config
        TOML with a table [simulate_cameras] (groma config prints it) or the run.toml of another run.
    """
    settings = settings_of("simulate_cameras", config, seed=seed, images=images or None)
    drawn = seed_of(settings)
    simulated = simulate_network(network_scene(scene, drawn))
    known = simulated.scene.known()
    recorded = {"scene": scene, **settings}
    with Run("recording", "simulate cameras", output, settings={"simulate_cameras": recorded}) as run:
        images = bool(settings["images"])
        messages = rendered_messages(simulated, keep=_keep(run.folder / "images")) if images else simulated.messages()
        seen = write_network(run.folder, simulated.scene.target, known, run.until_cancelled(messages))
        run.write_text("truth.json", _truth(simulated))
        run.write_text("settings.toml", to_toml({"cameras": simulated.scene.settings()}))
        stops = len(simulated.stops)
        figures = {"cameras": len(known), "stops": stops, "panels_seen": seen}
        run.finish(figures, f"{len(known)} cameras, {stops} stops, {seen} panels seen, seed {drawn}.")


def _keep(folder: Path) -> Keep:
    """Return what writes an image."""

    def keep(camera: str, stop: int, image: Gray) -> None:
        (folder / camera).mkdir(parents=True, exist_ok=True)
        with replacing(folder / camera / f"{stop:04}.png") as file:
            Image.fromarray(image).save(file, format="PNG")

    return keep


def _truth(simulated: SimulatedNetwork) -> str:
    """Return the true poses, in the frame of the map."""
    cameras = {
        camera.name: {"position": pose[:3].tolist(), "quaternion": pose[3:].tolist(), "parameters": lens.parameters}
        for camera, pose, lens in zip(simulated.scene.cameras, simulated.cameras, simulated.lenses, strict=True)
    }
    content = {"cameras": cameras, "mount": simulated.mount.tolist(), "stops": simulated.stops.tolist()}
    return json.dumps(content, indent=1) + "\n"

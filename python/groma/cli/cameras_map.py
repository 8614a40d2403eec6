"""`groma cameras map`: the recording of a survey in, the map of the building's cameras out."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from rich.console import Console

from groma.errors import EstimationError
from groma.io.atomic import write_text
from groma.io.camera_info import write_camera_info
from groma.io.kalibr_camchain import holds, write_camchain
from groma.io.network_file import chain, transforms, urdf, without_k3, write_network
from groma.io.network_recording import NetworkRecording, open_network
from groma.io.results import point_latest, result_directory, run_record, shown_command
from groma.io.toml import to_toml
from groma.io.trajectory import write_tum_rows
from groma.network import NetworkMap, NetworkMapper, network_defaults
from groma.report.network_figures import current, network_figures
from groma.report.network_report import network_report
from groma.report.network_words import network_verdict, warnings
from groma.settings import Settings, merged, read_table


def map_(
    recording: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    config: Path | None = None,
) -> None:
    """Map a building's cameras from a survey: their poses with joint covariance, their intrinsics, a report.

    groma cameras map survey

    Parameters
    ----------
    recording
        Folder with target, odometry, intrinsics, and detections or images (docs/reference/camera_network.md).
    output
        Folder for the results; a new one in results/ when left out.
    config
        TOML with a table [cameras] (groma config prints it) or the run.toml of another run.
    """
    found = open_network(recording)
    settings = merged(network_defaults(), read_table(config, "cameras") if config else {}, "cameras")
    new = output is None or not output.exists()
    directory = result_directory(output, datetime.now().astimezone())
    try:
        map_and_tell(directory, found, settings, shown_command(sys.argv[1:]))
    except BaseException:
        if new and not any(directory.iterdir()):
            directory.rmdir()
        raise
    if output is None:
        point_latest(directory)


def map_and_tell(directory: Path, found: NetworkRecording, settings: Settings, command: str) -> None:
    """Map a survey into a folder that exists, and say how it went."""
    network = map_into(directory, found, settings, command)
    for note in [*found.notes.lines(), *warnings(network)]:
        print(f"note: {note}", file=sys.stderr)
    print(network_verdict(network))
    print(f"{directory / 'report.html'}")


def map_into(directory: Path, recording: NetworkRecording, settings: Settings, command: str) -> NetworkMap:
    """Map a survey and write all files into a folder that exists."""
    console = Console(stderr=True)
    recording.cache = directory
    mapper = NetworkMapper(recording.target, recording.cameras)
    with console.status("reading") if console.is_terminal else _Silent():
        for message, stop in recording.messages():
            mapper.push(message, stop)
    with console.status("mapping") if console.is_terminal else _Silent():
        try:
            network = mapper.finish(settings)
        except EstimationError as error:
            raise EstimationError(f"{recording.path}: {error}") from error
    if not network.cameras:
        raise EstimationError(f"{recording.path}: no camera saw the target well enough to be placed")
    save_network(network, settings, recording.path, directory, command)
    return network


def save_network(
    network: NetworkMap, settings: Mapping[str, object], source: Path | None, directory: Path, command: str | None
) -> None:
    """Write all files of a map; the report comes last, so that it is there only when all are."""
    run = run_record({"cameras": settings}, source, command)
    write_network(directory / "network.json", network)
    (directory / "cameras").mkdir(exist_ok=True)
    for camera in current(network):
        write_camera_info(directory / "cameras" / f"{camera.name}.yaml", camera.name, camera.camera)
    lenses = {camera.name: without_k3(camera.camera) for camera in current(network)}
    if all(map(holds, lenses.values())):
        write_camchain(directory / "camchain.yaml", lenses, chain(network))
    write_text(directory / "network.urdf", urdf(network))
    write_text(directory / "static_transforms.txt", transforms(network))
    stamps = network.halt_stamps[network.stop_halts]
    write_tum_rows(directory / "stops.tum", np.column_stack([stamps, network.stops]))
    figures = json.dumps(network_figures(network), indent=1, sort_keys=True)
    write_text(directory / "metrics.json", figures + "\n")
    write_text(directory / "run.toml", to_toml(run))
    write_text(directory / "report.html", network_report(network, run))


class _Silent:
    """No progress where nobody watches."""

    def __enter__(self) -> None:
        """Say nothing."""

    def __exit__(self, *_: object) -> None:
        """Say nothing."""

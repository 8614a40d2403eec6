"""The files of a camera network that `groma cameras map` leaves beside what every run leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groma.io.atomic import write_text
from groma.io.camera_info import write_camera_info
from groma.io.kalibr_camchain import holds, write_camchain
from groma.io.network_file import chain, transforms, urdf, without_k3, write_network
from groma.io.trajectory import write_tum_rows
from groma.nouns.network import NetworkMap
from groma.report.network.figures import current


def save_network(network: NetworkMap, directory: Path) -> None:
    """Write the files of a network into a folder that exists.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
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

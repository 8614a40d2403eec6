"""What the map of a camera network means, in words: verdict, weak directions, remedies."""

from __future__ import annotations

import math

import numpy as np

from groma.network import MappedCamera, NetworkMap
from groma.report.network_figures import current, odometry_error, sigma_position, sigma_rotation
from groma.report.words import angle, count, length

WEAK_SHARE = 3.0
"""A direction is weak when its sigma is so many times the next smaller one."""
UNTOLD_SHARE = 0.9
"""The survey told nothing of a mount direction whose sigma it left at this share of the given one."""


def network_verdict(network: NetworkMap) -> str:
    """Return one sentence: how many cameras, how well, what is weak."""
    mapped = current(network)
    worst = max(mapped, key=sigma_position)
    text = (
        f"{count(len(mapped), 'camera')} mapped, each position to σ {length(sigma_position(worst))} or better "
        f"({worst.name} is the weakest), each direction to {angle(max(map(sigma_rotation, mapped)))}"
    )
    if network.slipped:
        return f"The odometry seems to have slipped: {network.slipped} cameras seem moved by it. {text}, if at all."
    if network.moved:
        names = " and ".join(sorted({name for name, _, _ in network.moved}))
        text += f"; {names} moved during the survey and {'was' if len(network.moved) == 1 else 'were'} mapped anew"
    if network.unseen:
        text += f"; not mapped: {', '.join(network.unseen)}"
    return text + "."


def weak_directions(network: NetworkMap) -> list[str]:
    """Return what the survey does not tell, or tells badly."""
    found = [_height(network)]
    found += [text for camera in current(network) if (text := _direction(camera))]
    return found


def remedies(network: NetworkMap) -> str:
    """Return what to do for a better map."""
    mapped = current(network)
    worst = max(mapped, key=sigma_position)
    drift = odometry_error(network)
    return (
        f"Odometry alone ends {length(drift)} off; what is left of it grows with the distance from the start and from "
        f"places passed twice. To know {worst.name} better, drive past it again from a camera that is known well, and "
        "close the loop."
    )


def _height(network: NetworkMap) -> str:
    sigma = math.sqrt(max(network.mount_covariance[2, 2], 0.0))
    if sigma == 0.0:
        return (
            "Height: a robot on a level floor cannot tell how high its target is; raising target and cameras together "
            "changes nothing. The height in the target file was taken as exact: an error of it is an error of every "
            "camera's height, and is in no σ here. Measure it, or give [cameras.mount] height."
        )
    return (
        "Height: a robot on a level floor cannot tell how high its target is (an uneven one tells a little). "
        f"All heights of cameras share its σ, {length(sigma)}."
    )


def _direction(camera: MappedCamera) -> str:
    values, vectors = np.linalg.eigh(camera.covariance[:3, :3])
    sigmas = np.sqrt(np.maximum(values, 0.0))
    if sigmas[2] < WEAK_SHARE * max(sigmas[1], 1e-9) or sigmas[2] < 0.02:
        return ""
    x, y, z = vectors[:, 2]
    if abs(z) > 0.9:
        way = "in height"
    else:
        way = f"along {round(math.degrees(math.atan2(y, x))) % 180}° from the x axis of the map"
    return f"{camera.name}: σ {length(float(sigmas[2]))} {way}, {length(float(sigmas[1]))} across it."

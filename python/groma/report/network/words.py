"""What the map of a camera network means, in words: verdict, weak directions, remedies."""

from __future__ import annotations

from groma.nouns.network import NetworkMap
from groma.report.network.figures import current, sigma_position, sigma_rotation
from groma.report.words import angle, count, length


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
    return found + [finding.text for finding in network.findings if finding.code == "camera-weak"]


def remedies(network: NetworkMap) -> str:
    """Return what to do for a better map."""
    mapped = current(network)
    worst = max(mapped, key=sigma_position)
    return (
        f"Odometry alone ends {length(network.odometry_error)} off; what is left of it grows with the distance from "
        f"the start and from places passed twice. To know {worst.name} better, drive past it again from a camera that "
        "is known well, and close the loop."
    )


def _height(network: NetworkMap) -> str:
    sigma = network.height_sigma
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

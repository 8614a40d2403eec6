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
        return f"The odometry seems to have slipped: {network.slipped} cameras seem to have moved. {text}, if at all."
    if network.moved:
        names = " and ".join(sorted({name for name, _, _ in network.moved}))
        text += f"; {names} moved during the survey and {'was' if len(network.moved) == 1 else 'were'} mapped again"
    if network.unseen:
        text += f"; not mapped: {', '.join(network.unseen)}"
    return text + "."


def weak_directions(network: NetworkMap) -> list[str]:
    """Return the unobservable and weak directions."""
    found = [_height(network)]
    return found + [finding.text for finding in network.findings if finding.code == "camera-weak"]


def remedies(network: NetworkMap) -> str:
    """Return what to do for a better map."""
    mapped = current(network)
    worst = max(mapped, key=sigma_position)
    return (
        f"Odometry alone ends {length(network.odometry_error)} off; its remaining error grows with the distance from "
        f"the start and from places passed twice. To improve {worst.name}, drive past it again from an accurate "
        "camera, and close the loop."
    )


def _height(network: NetworkMap) -> str:
    sigma = network.height_sigma
    if sigma == 0.0:
        return (
            "Height: on a level floor the height of the target is unobservable; raising target and cameras together "
            "changes nothing. The height in the target file is assumed exact: its error is an error of every "
            "camera's height, and in no σ here. Measure it, or give [cameras.mount] height."
        )
    return (
        "Height: on a level floor the height of the target is unobservable (on an uneven one weakly observable). "
        f"Its σ, {length(sigma)}, is common to all cameras."
    )

"""What the map of a camera network says of itself, as findings: slip, moved and unseen cameras, misfits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from groma.findings import Finding
from groma.network import MappedCamera, NetworkMap
from groma.report.network_figures import corner_chi_square, current
from groma.report.words import angle, count, length

DISHONEST = 1.5
"""Chi-square per degree of freedom from which on standard deviations are called too small."""
WORSE = 2.0
"""A camera fits badly when its chi-square is so many times that of all."""
LEAST_STEPS = 10
"""Steps of odometry from which on their fit says something."""


def network_findings(network: NetworkMap) -> list[Finding]:
    """Return the findings on a network, in the order of their weight."""
    return [
        *_convergence(network),
        *_slip(network),
        *_moved(network),
        *_corners(network),
        *_odometry(network),
        *(Finding("camera-unseen", f"{name}: never seen well enough to be placed") for name in network.unseen),
        *_views(network),
    ]


def _convergence(network: NetworkMap) -> Iterator[Finding]:
    if not network.converged:
        yield Finding("not-converged", "the batch did not converge")


def _slip(network: NetworkMap) -> Iterator[Finding]:
    if network.slipped:
        text = (
            f"{network.slipped} cameras in turn seem moved; cameras rarely move together: the odometry slipped or "
            "jumped before"
        )
        yield Finding("odometry-jump", text, values={"cameras": (network.slipped, "1")})


def _moved(network: NetworkMap) -> Iterator[Finding]:
    if network.slipped:
        return
    for name, old, new in network.moved:
        yield _motion(name, network.cameras[old], network.cameras[new])


def _motion(name: str, old: MappedCamera, new: MappedCamera) -> Finding:
    distance = float(np.linalg.norm(new.pose[:3] - old.pose[:3]))
    turn = 2 * math.acos(min(1.0, abs(float(new.pose[3:] @ old.pose[3:]))))
    text = (
        f"{name} was moved during the survey, by {length(distance)} and {angle(turn)}: it was mapped anew from then "
        "on; fasten it, and tell what used its old pose"
    )
    x, y = (float(v) for v in new.pose[:2])
    values = {"distance": (distance, "m"), "turn": (turn, "rad")}
    return Finding("camera-moved", text, place=(x, y), values=values)


def _corners(network: NetworkMap) -> Iterator[Finding]:
    chi = corner_chi_square(network)
    if chi > DISHONEST:
        text = (
            f"corners fit {math.sqrt(chi):.1f} times worse than their σ: check sizes and places of the panels in the "
            "target file, the calibration of the cameras, and the σ of the detector"
        )
        yield Finding("sigma-too-small", text, values={"factor": (math.sqrt(chi), "1")})
    for camera in current(network):
        if camera.chi_square_per_dof > WORSE * max(chi, 1.0):
            factor = math.sqrt(camera.chi_square_per_dof)
            text = f"{camera.name}: its corners fit {factor:.1f} times worse than their σ: calibrate it again"
            yield Finding("sigma-too-small", text, values={"factor": (factor, "1")})


def _odometry(network: NetworkMap) -> Iterator[Finding]:
    chi, steps = network.residuals["odometry"]
    if steps > LEAST_STEPS and chi / steps > DISHONEST:
        factor = math.sqrt(chi / steps)
        text = f"the odometry is {factor:.1f} times worse than its settings say: raise those of [cameras.odometry]"
        yield Finding("sigma-too-small", text, values={"factor": (factor, "1")})


def _views(network: NetworkMap) -> Iterator[Finding]:
    verdicts = list(network.views.verdicts)
    for why in sorted(set(verdicts) - {"taken", "first sight"}):
        size = verdicts.count(why)
        yield Finding("views-left-out", f"{count(size, 'view')}: {why}", values={"count": (size, "1")})

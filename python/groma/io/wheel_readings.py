"""The readings of the wheels in a recording: the joints that a vehicle file names, as arrays.

Readings that are late, repeated or not finite are left out and counted, as in a drive.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.recording import Recording
from groma.io.streams import Kind
from groma.models import JointState
from groma.vehicle import Vehicle

Array = NDArray[np.float64]


def read_wheels(recording: Recording, vehicle: Vehicle, skipped: Counter[str]) -> tuple[Array, Array]:
    """Return stamps (K,) and readings (K, 2) of the wheels.

    Parameters
    ----------
    recording
        An open recording.
    vehicle
        Names the joints; without names there must be one stream of two joints.
    skipped
        Counts what is left out, by reason.

    Raises
    ------
    UserError
        When the joints are not there, or hardly any reading of them.
    """
    streams = [stream.name for stream in recording.streams if stream.kind is Kind.JOINTS]
    if not streams:
        raise UserError(f"{recording.path}: no joint states in it: without them a vehicle file is of no use")
    rows = []
    last = -np.inf
    for message in recording.messages(set(streams)):
        if not isinstance(message, JointState):
            continue
        row = _row(message, vehicle.joints)
        if row is None:
            continue
        if not np.isfinite([message.stamp, *row]).all():
            skipped["wheel readings that are no number"] += 1
        elif message.stamp <= last:
            skipped["wheel readings that are late or repeated"] += 1
        else:
            last = message.stamp
            rows.append((message.stamp, *row))
    if len(rows) < 2:
        names = " and ".join(vehicle.joints) or "two joints"
        raise UserError(
            f"{recording.path}: {len(rows)} readings of {names}: [joints] of the vehicle file names others?"
        )
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def _row(message: JointState, joints: tuple[str, ...]) -> tuple[float, float] | None:
    if joints:
        if not set(joints) <= set(message.names):
            return None
        first, second = (float(message.positions[message.names.index(name)]) for name in joints)
        return first, second
    if len(message.positions) != 2:
        return None
    return float(message.positions[0]), float(message.positions[1])

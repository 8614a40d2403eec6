"""From what the wheels say in a step to a motion with its noise.

>>> from groma.localization.wheels import Wheels
>>> fork = Wheels("tricycle", (2.5e-4, 1.5, 1.0, 0.0, 0.0))
>>> motion, covariance, by_drive = fork.motion(400.0, 0.1, duration=0.1)
>>> [round(v, 5) for v in motion]
[0.0995, 0.00033, 0.00666]
"""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from groma import _core
from groma.nouns.arrays import Array
from groma.nouns.poses import Pose
from groma.nouns.vehicle import WheelNoise, usual_noise


class Wheels:
    """The drive of a vehicle.

    Parameters
    ----------
    drive
        ``tricycle`` (one steered, driven wheel) or ``differential`` (two driven wheels).
    parameters
        Five of a tricycle: metres a count, wheelbase [m], gain of the steering, its offset forward and backward [rad];
        three of a differential drive: metres a count of the left and of the right wheel, axle [m].
    noise
        Usual when None.
    """

    def __init__(
        self, drive: Literal["tricycle", "differential"], parameters: ArrayLike, noise: WheelNoise | None = None
    ) -> None:
        numbers = np.asarray(parameters, dtype=np.float64).ravel()
        expected = 5 if drive == "tricycle" else 3
        if drive not in ("tricycle", "differential") or len(numbers) != expected:
            raise ValueError(f"a {drive} with {len(numbers)} parameters: a tricycle has 5, a differential drive 3")
        self._tricycle = drive == "tricycle"
        self._parameters = np.pad(numbers, (0, 5 - expected)).tolist()
        self._noise = json.dumps(asdict(noise or usual_noise()))

    def motion(self, first: float, second: float, duration: float) -> tuple[Pose, Array, Array]:
        """Return the motion of a step.

        Parameters
        ----------
        first, second
            Counts since the step before and angle of the steering encoder [rad] of a tricycle; counts of the left and
            of the right wheel of a differential drive.
        duration
            Of the step [s].

        Returns
        -------
        tuple
            ``T_before_after`` as x, y [m], theta [rad]; (3, 3) covariance of its body-frame perturbation; (3, 5) its
            derivative by the parameters: what :meth:`groma.localization.localizer.Localizer.predict` takes.
        """
        return _core.wheel_motion(self._tricycle, self._parameters, (first, second), duration, self._noise)

"""Calibrate a vehicle: its wheels, its steering and where its laser sits, from wheel readings and laser motions.

The core sees raw readings and the times of the motions, so that wheels can be interpolated at the time of a scan and a
delay between the clocks can be estimated. Motions are those of the laser frame. Formulas and sources:
docs/theory/vehicle_calibration.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Model = Literal["tricycle", "tricycle-asymmetric", "differential"]


@dataclass(frozen=True, slots=True)
class OdometryLog:
    """Readings of the wheels, times strictly rising, counters unwrapped."""

    time: Array
    """(n,) seconds."""
    ticks: Array
    """(n, wheels) cumulative: one column for the drive wheel of a tricycle, left and right for a differential drive.
    Counts or radians: a scale is metres per unit, so that radians give a radius."""
    steering: Array | None = None
    """(n,) angle of the steering encoder [rad], to the left positive; None for a differential drive."""


@dataclass(frozen=True, slots=True)
class SensorMotions:
    """How the laser moved between pairs of scans, in order of time."""

    start: Array
    """(m,) time of the first scan [s]."""
    end: Array
    """(m,) time of the second scan [s], after the first."""
    motion: Array
    """(m, 3) ``T_first_second`` as x, y, theta. Theta is the whole turn, not wrapped: an arc of 240 deg has 240 deg."""
    covariance: Array | None = None
    """(m, 3, 3) of the perturbation ``T * exp(xi)``; None where unknown, then it is estimated, one for all."""
    coupling: Array | None = None
    """(m - 1, 3, 3) covariance of the errors of a motion and the next, which share a scan; None where they are
    independent."""

    @classmethod
    def from_poses(cls, stamps: ArrayLike, poses: ArrayLike, covariances: ArrayLike) -> SensorMotions:
        """Motions between consecutive poses whose errors are independent.

        Parameters
        ----------
        stamps
            (m + 1,) seconds, rising.
        poses
            (m + 1, 3) ``T_map_laser``; theta unwrapped, so that its difference is the whole turn.
        covariances
            (m + 1, 3, 3) of ``T * exp(xi)``.
        """
        time, at = np.asarray(stamps, dtype=np.float64), np.asarray(poses, dtype=np.float64)
        of_pose = np.asarray(covariances, dtype=np.float64)
        step = np.diff(at, axis=0)
        cos, sin = np.cos(at[:-1, 2]), np.sin(at[:-1, 2])
        x, y = cos * step[:, 0] + sin * step[:, 1], cos * step[:, 1] - sin * step[:, 0]
        motion = np.column_stack([x, y, step[:, 2]])
        back = _adjoint_of_inverse(motion)
        covariance = of_pose[1:] + back @ of_pose[:-1] @ back.transpose(0, 2, 1)
        coupling = -of_pose[1:-1] @ back[1:].transpose(0, 2, 1)
        return cls(time[:-1], time[1:], motion, covariance, coupling)


@dataclass(frozen=True, slots=True)
class FitTest:
    """A question to the residuals."""

    name: str
    """What was asked: ``asymmetry``, ``fit``, ``direction``, ``speed``, ``steering``."""
    statistic: float
    dof: int
    p_value: float
    """Probability of a statistic as large if the model holds."""
    words: str
    """The answer, in a sentence."""


@dataclass(frozen=True, slots=True)
class WeakDirection:
    """A combination of parameters that the drive leaves open."""

    direction: Array
    """(p,) of the free parameters, of unit length in units of each parameter's typical error."""
    words: str
    """Which they are and what to drive, in a sentence."""


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Errors of motions predicted by parameters that were estimated without them."""

    folds: int
    position_median: float
    """[m]"""
    heading_median: float
    """[rad]"""
    position_rms: float
    """Of the best nine in ten [m]."""


@dataclass(frozen=True, slots=True)
class VehicleCalibration:
    """Parameters of a vehicle with what is known of their errors."""

    model: Model
    names: tuple[str, ...]
    """Of the p free parameters: ``drive_scale`` [m/unit], ``wheelbase`` [m], ``steering_gain``, ``steering_offset`` or
    ``steering_offset_forward`` and ``_backward`` [rad]; ``left_radius``, ``right_radius`` [m/unit], ``axle`` [m];
    ``laser_x``, ``laser_y`` [m], ``laser_yaw`` [rad]; ``delay`` [s], wheels are read at the time of the scan plus
    it."""
    values: Array
    """(p,)"""
    covariance: Array
    """(p, p), over the directions that are not weak."""
    fixed: dict[str, float]
    """Parameters that were given, by name."""
    chi_square: float
    """Of the whitened residuals, before they scale anything."""
    dof: int
    noise_scale: float
    """Factor on the stated standard deviations that the residuals ask for; 1 where the noise is taken as known."""
    residuals: Array
    """(m, 3) what the laser moved beyond the prediction, in its frame at the end: x, y, theta."""
    weights: Array
    """(m,) 1 for a motion that counts in full, towards 0 for an outlier; NaN for one that was left out."""
    tests: tuple[FitTest, ...]
    weak: tuple[WeakDirection, ...]
    held_out: HeldOut | None
    notes: tuple[str, ...]
    """What was assumed, chosen or left out, in sentences."""

    @property
    def sigmas(self) -> Array:
        """(p,) standard deviations."""
        sigmas: Array = np.sqrt(np.diag(self.covariance))
        return sigmas

    @property
    def correlation(self) -> Array:
        """(p, p) correlation coefficients."""
        sigmas = np.where(self.sigmas > 0.0, self.sigmas, 1.0)
        correlation: Array = self.covariance / np.outer(sigmas, sigmas)
        return correlation

    @property
    def parameters(self) -> dict[str, float]:
        """Every parameter, free or fixed, by name."""
        return self.fixed | dict(zip(self.names, self.values.tolist(), strict=True))


def _adjoint_of_inverse(motion: Array) -> Array:
    """(m, 3, 3) ``Ad(T^-1)``: a perturbation before a motion, seen after it."""
    x, y, (cos, sin) = motion[:, 0], motion[:, 1], (np.cos(motion[:, 2]), np.sin(motion[:, 2]))
    adjoint = np.zeros((len(motion), 3, 3))
    adjoint[:, 0] = np.column_stack([cos, sin, x * sin - y * cos])
    adjoint[:, 1] = np.column_stack([-sin, cos, x * cos + y * sin])
    adjoint[:, 2, 2] = 1.0
    return adjoint

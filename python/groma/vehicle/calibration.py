"""Calibrate a vehicle: its wheels, its steering and where its laser sits, from wheel readings and laser motions.

The core sees raw readings and the times of the motions, so that wheels can be interpolated at the time of a scan and a
delay between the clocks can be estimated. Motions are those of the laser frame. Formulas and sources:
docs/theory/vehicle_calibration.md.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypedDict, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.nouns.arrays import Array
from groma.vehicle.motions import OdometryLog as OdometryLog
from groma.vehicle.motions import SensorMotions as SensorMotions
from groma.vehicle.motions import blocks, to_readings, to_rows

Model = Literal["tricycle", "tricycle-asymmetric", "differential"]
Free = Literal["wheelbase", "gain", "delay"]


class CalibrationOptions(TypedDict, total=False):
    """Settings of :func:`calibrate`; their defaults are those of the core."""

    robust: bool
    """Whether outliers are expected: Student's distribution instead of the normal one."""
    tail: float
    """Degrees of freedom of Student's distribution."""
    noise_known: bool
    """Whether the stated noise is taken as it is; otherwise the residuals scale it."""
    slip: float
    """Slip of a wheel: standard deviation after a metre of path [m]; it grows with the root of the path."""
    steering: float
    """Standard deviation of the steering angle that the encoder does not see [rad]."""
    memory: float
    """For how long a steering error lasts before it is another one [s]."""
    folds: int
    """Parts of the motions that are held out in turn; 0 leaves this out."""
    asymmetry_level: float
    """Level at which an asymmetry of the steering is accepted."""
    asymmetry_sigma_max: float
    """An asymmetry less certain than this is not believed whatever its size [rad]."""
    delay_max: float
    """Largest delay that is looked for [s]."""


@dataclass(frozen=True, slots=True)
class FitTest:
    """A question to the residuals."""

    name: str
    """What was asked: ``asymmetry`` (is the steering offset the same both ways), ``fit`` (are residuals as large as the
    stated noise), ``direction``, ``speed``, ``steering`` (do motions of a kind miss alike)."""
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
class Verdict:
    """Whether the estimate is as good as wanted."""

    enough: bool
    missed: dict[str, float]
    """Half-widths that are above their tolerance, by name."""


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
    sigmas: Array
    """(p,) standard deviations."""
    correlation: Array
    """(p, p) correlation coefficients."""
    fixed: dict[str, float]
    """Parameters that were given, by name."""
    chi_square: float
    """Of the whitened residuals, before they scale anything."""
    dof: int
    noise_scale: float
    """Factor on the stated standard deviations that the residuals ask for; 1 where the noise is taken as known, or
    where none was stated."""
    converged: bool
    """Whether the estimate came to rest."""
    observed: NDArray[np.bool_]
    """(p,) False for a parameter that has a part in a weak direction: neither value nor sigma say anything."""
    interval_dof: int | None
    """Degrees of freedom of intervals; None where the noise is taken as known."""
    correlated: bool
    """Whether the covariance allows for errors that neighbouring motions share."""
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
    def parameters(self) -> dict[str, float]:
        """Every parameter, free or fixed, by name."""
        return self.fixed | dict(zip(self.names, self.values.tolist(), strict=True))

    def half_widths(self, confidence: float = 0.95, *, simultaneous: bool = False) -> Array:
        """(p,) half-widths of intervals by Student's distribution, infinite for what is not observed.

        Parameters
        ----------
        confidence
            Probability that an interval holds the truth.
        simultaneous
            Whether that is to hold for all parameters at once (Bonferroni).
        """
        claims = len(self.names) if simultaneous else 1
        factor = _core.interval_factor(confidence, self.interval_dof, claims)
        widths: Array = np.where(self.observed, factor * self.sigmas, np.inf)
        return widths

    def verdict(
        self, tolerances: Mapping[str, float], confidence: float = 0.95, *, simultaneous: bool = False
    ) -> Verdict:
        """Tell whether to stop driving.

        Parameters
        ----------
        tolerances
            Largest half-width wanted, by name of a free parameter.
        confidence, simultaneous
            As in :meth:`half_widths`.

        Raises
        ------
        ValueError
            If a name is no free parameter or a tolerance is not above 0.
        """
        for name, tolerance in tolerances.items():
            if name not in self.names:
                raise ValueError(f"tolerance of {name}: the free parameters are {', '.join(self.names)}")
            if not tolerance > 0.0:
                raise ValueError(f"tolerance of {name}: must be above 0, not {tolerance}")
        widths = dict(zip(self.names, self.half_widths(confidence, simultaneous=simultaneous).tolist(), strict=True))
        missed = {name: widths[name] for name, tolerance in tolerances.items() if not widths[name] <= tolerance}
        return Verdict(not missed, missed)


def calibration_defaults() -> dict[str, object]:
    """Return the default of every setting of :func:`calibrate`."""
    defaults: dict[str, object] = json.loads(_core.vehicle_calibration_defaults())
    return defaults


def interval_factor(confidence: float, dof: int | None, claims: int = 1) -> float:
    """Return the half-width of an interval over the standard deviation.

    Student's quantile for ``dof`` degrees of freedom, the normal one for None; ``claims`` intervals are to hold at once
    (Bonferroni).
    """
    return _core.interval_factor(confidence, dof, claims)


def driving_factor(half_width: float, tolerance: float) -> float:
    """Return how many times the driving so far it takes to bring a half-width to a tolerance, of the same kind."""
    return _core.driving_factor(half_width, tolerance)


def calibrate(
    model: Model | Literal["auto"],
    log: OdometryLog,
    motions: SensorMotions,
    *,
    wheelbase: float | None = None,
    gain: float = 1.0,
    delay: float = 0.0,
    free: Iterable[Free] = (),
    **options: Unpack[CalibrationOptions],
) -> VehicleCalibration:
    """Estimate a vehicle from its wheels and the motions of its laser. No first guess is needed.

    Parameters
    ----------
    model
        ``auto`` takes a differential drive where the log has no steering, else a tricycle, with two steering offsets
        where their difference is significant and the drive holds it.
    log
        Readings of the wheels; they should reach beyond the motions by ``delay_max`` where the delay is free.
    motions
        Motions of the laser; those beyond the log are left out, with a note.
    wheelbase
        Of a tricycle [m], negative where the steered wheel is behind; estimated where left out.
    gain
        Angle of the wheel per angle of the steering encoder; about where to look for it where it is free. Where it is
        free, the sign of the drive scale is taken as positive.
    delay
        Of the wheels [s], where it is not free: they are read at the time of a scan plus it.
    free
        What to estimate beside the drive, its offsets and the pose of the laser.
    **options
        See :class:`CalibrationOptions`.

    Returns
    -------
    VehicleCalibration
        Also where the drive leaves directions open: they are told, not refused.

    Raises
    ------
    EstimationError
        If too few motions lie within the log, or nothing moved.
    ValueError
        If model, log and options do not go together, an array has a wrong shape or is not finite, times do not rise, or
        a covariance is none.
    """
    time, readings = to_readings(log)
    rows = to_rows(motions)
    covariance = blocks("covariance", motions.covariance, len(rows))
    coupling = blocks("coupling", motions.coupling, max(len(rows) - 1, 0))
    asked = (None if model == "auto" else model, wheelbase, gain, delay, [str(name) for name in free])
    steered = log.steering is not None
    return to_calibration(
        _core.vehicle_calibrate(time, readings, steered, rows, covariance, coupling, asked, json.dumps(options))
    )


def to_calibration(found: _core.VehicleEstimate) -> VehicleCalibration:
    """Return an estimate of the core as a value."""
    return VehicleCalibration(
        model=cast(Model, found.model),
        names=tuple(found.names),
        values=found.values,
        sigmas=found.sigmas,
        correlation=found.correlation,
        covariance=found.covariance,
        fixed=found.fixed,
        chi_square=found.chi_square,
        dof=found.dof,
        interval_dof=found.interval_dof,
        noise_scale=found.noise_scale,
        correlated=found.correlated,
        converged=found.converged,
        observed=np.array(found.observed, bool),
        residuals=found.residuals,
        weights=found.weights,
        tests=tuple(FitTest(name, value, dof, p, _words(name, p)) for name, value, dof, p in found.tests),
        weak=tuple(WeakDirection(np.array(direction), words) for direction, words in found.weak),
        held_out=None if found.held_out is None else HeldOut(*found.held_out),
        notes=tuple(found.notes),
    )


def closed_form(
    model: Model,
    log: OdometryLog,
    motions: SensorMotions,
    *,
    wheelbase: float | None = None,
    gain: float = 1.0,
    form: Literal["wheels", "centres"] = "wheels",
    rounds: int = 0,
    share: float = 0.01,
) -> tuple[dict[str, float], NDArray[np.int64]] | None:
    """Estimate a vehicle in closed form, all motions alike, as a start or to compare with.

    Parameters
    ----------
    model, log, motions, wheelbase, gain
        As in :func:`calibrate`; the wheelbase of a tricycle is free where left out.
    form
        ``wheels`` takes turns from the wheels (Censi et al. 2013), ``centres`` from the laser: on arcs of constant
        steering the centres of turning lie on the rear axle.
    rounds, share
        So often the share of motions with the largest residuals in heading, and in place, is dropped.

    Returns
    -------
    tuple or None
        Parameters by name and the indices of the motions that were kept; None when the motions do not hold them.
    """
    time, readings = to_readings(log)
    free = ["wheelbase"] if wheelbase is None and model != "differential" else []
    asked = (model, wheelbase, gain, 0.0, free)
    steered = log.steering is not None
    found = _core.vehicle_closed_form(
        time, readings, steered, to_rows(motions), asked, form == "centres", (rounds, share)
    )
    return None if found is None else (dict(found[0]), np.array(found[1], dtype=np.int64))


_ASKED = {
    "asymmetry": ("the steering offset is not the same both ways", "the steering offset may be the same both ways"),
    "fit": ("residuals are larger than the stated noise explains", "residuals are as the stated noise says"),
    "direction": ("motions forward and backward miss differently", "motions forward and backward fit alike"),
    "speed": ("slow and fast motions miss differently", "slow and fast motions fit alike"),
    "steering": ("motions to the left and right miss differently", "motions to the left and right fit alike"),
}
_LEVEL = 0.01
"""Probability below which a test tells against the model."""


def _words(name: str, p_value: float) -> str:
    against, with_it = _ASKED[name]
    shown = f"p = {p_value:.2g}" if p_value >= 1e-6 else "p < 1e-6"
    return f"{against if p_value < _LEVEL else with_it} ({shown})"

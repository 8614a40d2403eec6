"""Intrinsics of a camera from detections of a target, and poses of panels seen by a calibrated camera.

The estimators are in the core; formulas and assumptions: docs/theory/camera_calibration.md. Poses are
``T_camera_panel`` as (4, 4); their covariances are those of the right perturbation ``T exp(d)``, metres before radians.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma import _core
from groma.errors import EstimationError, UserError
from groma.nouns.arrays import Array
from groma.nouns.camera import Camera
from groma.nouns.detection import Detection
from groma.nouns.target import Target

DISHONEST = 1.5
"""Above this factor the claimed standard deviations are called too small."""


@dataclass(frozen=True, slots=True)
class Honesty:
    """Check of the claimed covariance by split halves of the images."""

    factor: float | None
    """By what standard deviations should be multiplied; None when there were too few images to tell."""
    z_rms: Array
    """(n,) difference of each parameter between halves in units of its claim, root mean square; 1 when it holds."""
    projection_rms: float
    """Distance between projections by the two halves over the image, best rotation taken out [pixel]."""
    splits: int
    """Splits that were compared."""


@dataclass(frozen=True, slots=True)
class ViewFit:
    """What is known of one panel in one image."""

    detection: Detection
    pose: Array
    """(4, 4) ``T_camera_panel``."""
    white: Array
    """(6, 6) covariance of the pose from the corners alone."""
    covariance: Array
    """(6, 6) covariance of the pose with the share of the parameters."""
    decided: bool
    """Whether the mirrored pose explains the corners clearly worse."""
    taken: bool
    """Whether the view took part in the refinement, or was held out."""
    residuals: Array
    """(k, 2) predicted less seen [pixel]."""
    used: NDArray[np.bool_]
    """(k,) which corners were used."""
    rms: float
    """Root mean square length of the residuals of the corners used [pixel]; NaN without any."""
    distance: float
    """Of the origin of the panel [m]."""
    tilt: float
    """Angle between its normal and the line of sight [rad]."""
    sigma_depth: float
    """Standard deviation of its depth [m]."""


@dataclass(frozen=True, slots=True)
class CameraCalibration:
    """A calibrated camera and what is known of it."""

    camera: Camera
    claimed: Array
    """(n, n) covariance of the parameters as the residuals claim it."""
    covariance: Array
    """(n, n) covariance to use: the formal one times ``max(1, factor)^2`` of the split halves."""
    sigmas_claimed: tuple[float, ...]
    """(n,) standard deviations as the residuals claim them."""
    sigmas: tuple[float, ...]
    """(n,) standard deviations to pass on."""
    residual_factor: float
    """Standard deviation of a residual, relative to what the corners claim."""
    rms: float
    """Root mean square length of the residuals of the corners used [pixel]."""
    rms_all: float
    """The same over all corners of the views used [pixel]."""
    held_out_rms: float | None
    """The same over the views that took no part [pixel]; None without any."""
    tilt_spread: float
    """Largest angle between the panels of two views that took part [rad]."""
    weak: tuple[tuple[str, ...], float]
    """The most strongly correlated parameters, each in units of its own standard deviation, and the share of
    that combination of their common scatter."""
    dof: int
    honesty: Honesty
    views: tuple[ViewFit, ...]
    left_out: tuple[Detection, ...]
    """Detections that no pose explains, or with too few corners."""


@dataclass(frozen=True, slots=True)
class PanelPose:
    """Where a panel is, seen by a calibrated camera."""

    pose: Array
    """(4, 4) ``T_camera_panel``."""
    covariance: Array
    """(6, 6) from the corners alone."""
    sensitivity: Array
    """(6, n): what an error b of the camera's parameters (true less assumed) does, ``d = S b``; common to all views."""
    chi_square: float
    dof: int
    decided: bool
    """Whether the other pose can be left aside."""
    other: tuple[Array, float] | None
    """The mirrored pose and its squared residuals, when it is another one."""


def camera_defaults() -> dict[str, object]:
    """Return the settings of the calibration with their defaults."""
    defaults: dict[str, object] = json.loads(_core.camera_calibration_defaults())
    return defaults


def calibrate_camera(
    size: tuple[int, int],
    target: Target,
    detections: Sequence[Detection],
    settings: Mapping[str, object] | None = None,
    token: _core.Token | None = None,
) -> CameraCalibration:
    """Calibrate a camera.

    Parameters
    ----------
    size
        Columns and rows of its images.
    target
        What was seen.
    detections
        Of this camera; those of one stamp are of one image.
    settings
        Those of :func:`camera_defaults`, changed.
    token
        Cancels the work; KeyboardInterrupt tells so.

    Raises
    ------
    UserError
        When a setting is unknown or makes no sense.
    EstimationError
        When the views do not allow it, with the reason and what to do.
    """
    stamps = np.array([detection.stamp for detection in detections])
    images = np.unique(stamps, return_inverse=True)[1].tolist()
    views = [(int(image), len(d.corners)) for image, d in zip(images, detections, strict=True)]
    merged = {**camera_defaults(), **(settings or {})}
    try:
        core = _core.calibrate_camera(size, views, *flat_corners(target, detections), json.dumps(merged), token)
    except ValueError as error:
        raise UserError(f"setting of camera: {error}") from error
    except RuntimeError as error:
        raise EstimationError(str(error)) from error
    return _result(Camera(*size, str(merged["lens"]), tuple(core.parameters)), core, detections)


def panel_pose(camera: Camera, target: Target, detection: Detection) -> PanelPose | None:
    """Return the pose of a panel; None when its corners tell none."""
    found = _core.camera_panel_pose(camera.json(), *flat_corners(target, [detection]))
    if found is None:
        return None
    pose, covariance, sensitivity, chi_square, dof, decided, other = found
    return PanelPose(
        pose=pose.reshape(4, 4),
        covariance=covariance.reshape(6, 6),
        sensitivity=sensitivity.reshape(-1, 6).T,
        chi_square=chi_square,
        dof=dof,
        decided=decided,
        other=None if other is None else (other[0].reshape(4, 4), other[1]),
    )


def projection_sigmas(camera: Camera, covariance: Array) -> tuple[Array, Array]:
    """Return what an uncertainty of the parameters means in pixels, over the image, best rotation taken out.

    Parameters
    ----------
    camera
        The camera.
    covariance
        (n, n) of its parameters.

    Returns
    -------
    pixels
        (rows, columns, 2) a grid over the image.
    sigmas
        (rows, columns) standard deviation in the worst direction [pixel]; NaN where the lens model does not reach.
    """
    (columns, rows), pixels, sigmas = _core.projection_sigmas(camera.json(), np.ascontiguousarray(covariance))
    return pixels.reshape(rows, columns, 2), sigmas.reshape(rows, columns)


def flat_corners(target: Target, detections: Sequence[Detection]) -> tuple[Array, Array, Array]:
    """Return points (N, 3), pixels (N, 2) and sigmas (N,) of all corners, one detection after the other."""
    corners = {panel.name: panel.corners for panel in target.panels}
    points = [corners[detection.panel][detection.corners] for detection in detections]
    pixels = [detection.pixels for detection in detections]
    sigmas = [detection.sigma for detection in detections]
    return (
        np.vstack([np.empty((0, 3)), *points]),
        np.vstack([np.empty((0, 2)), *pixels]),
        np.concatenate([np.empty(0), *sigmas]),
    )


def _result(camera: Camera, core: _core.CameraArrays, detections: Sequence[Detection]) -> CameraCalibration:
    n, count = len(core.parameters), len(detections)
    poses = core.poses.reshape(count, 4, 4)
    white, covariances = core.white.reshape(count, 6, 6), core.covariances.reshape(count, 6, 6)
    ends = np.cumsum([0, *(len(d.corners) for d in detections)])
    residuals, used = core.residuals.reshape(-1, 2), np.array(core.used, dtype=bool)
    views = [
        ViewFit(
            detection=detection,
            pose=poses[k],
            white=white[k],
            covariance=covariances[k],
            decided=core.decided[k],
            taken=core.taken[k],
            residuals=residuals[ends[k] : ends[k + 1]],
            used=used[ends[k] : ends[k + 1]],
            rms=math.nan if (rms := core.view_rms[k]) is None else rms,
            distance=place[0],
            tilt=place[1],
            sigma_depth=place[2],
        )
        for k, (detection, place) in enumerate(zip(detections, core.view_places, strict=True))
        if place is not None
    ]
    return CameraCalibration(
        camera=camera,
        claimed=core.covariance.reshape(n, n),
        covariance=core.inflated.reshape(n, n),
        sigmas_claimed=tuple(core.sigmas_claimed),
        sigmas=tuple(core.sigmas),
        residual_factor=core.residual_factor,
        rms=core.rms,
        rms_all=core.rms_all,
        held_out_rms=core.held_out_rms,
        tilt_spread=core.tilt_spread,
        weak=(tuple(camera.names[k] for k in core.weak[0]), core.weak[1]),
        dof=core.dof,
        honesty=Honesty(core.honesty, np.array(core.z_rms), core.projection_rms, core.splits),
        views=tuple(views),
        left_out=tuple(d for known, d in zip(core.known, detections, strict=True) if not known),
    )

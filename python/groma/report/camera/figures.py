"""The figures of a calibrated camera, for metrics.json, the report and the command line."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from groma.cameras.calibration import CameraCalibration, projection_sigmas
from groma.cameras.images import Sightings
from groma.nouns.arrays import Array

CELLS = (8, 6)
"""Columns and rows of the grid by which the coverage of the image is counted."""


def camera_figures(found: CameraCalibration, sightings: Sightings) -> Mapping[str, object]:
    """Return all figures by name."""
    worst = projection_sigmas(found.camera, found.covariance)[1]
    views = found.views
    return {
        "camera": dict(zip(found.camera.names, found.camera.parameters, strict=True)),
        "sigma": dict(zip(found.camera.names, found.sigmas, strict=True)),
        "lens": found.camera.lens,
        "images": len(sightings.names),
        "images_without_target": len(sightings.empty),
        "views_used": sum(view.taken for view in views),
        "views_held_out": sum(not view.taken for view in views),
        "views_left_out": len(found.left_out),
        "views_undecided": sum(not view.decided for view in views),
        "corners_used": int(sum(view.used.sum() for view in views if view.taken)),
        "corners_left_out": int(sum((~view.used).sum() for view in views if view.taken)),
        "tags_left_out": dict(sightings.left_out),
        "rms_px": found.rms,
        "rms_all_corners_px": found.rms_all,
        "rms_held_out_px": found.held_out_rms,
        "residual_factor": found.residual_factor,
        "honesty_factor": found.honesty.factor,
        "honesty_splits": found.honesty.splits,
        "honesty_z_rms": dict(zip(found.camera.names, found.honesty.z_rms.tolist(), strict=True)),
        "halves_projection_rms_px": found.honesty.projection_rms,
        "projection_sigma_median_px": float(np.nanmedian(worst)),
        "projection_sigma_worst_px": float(np.nanmax(worst)),
        "coverage": coverage(found),
        "tilt_spread_deg": float(np.degrees(found.tilt_spread)),
    }


def used_pixels(found: CameraCalibration) -> tuple[Array, Array]:
    """Return pixels (N, 2) and residuals (N, 2) of all corners used."""
    taken = [view for view in found.views if view.taken]
    pixels = np.vstack([view.detection.pixels[view.used] for view in taken])
    return pixels, np.vstack([view.residuals[view.used] for view in taken])


def coverage(found: CameraCalibration) -> float:
    """Return the share of the image's cells in which corners were seen."""
    pixels = used_pixels(found)[0]
    cells = np.floor((pixels + 0.5) / [found.camera.width, found.camera.height] * CELLS).astype(np.int64)
    inside = ((cells >= 0) & (cells < CELLS)).all(axis=1)
    return len(np.unique(cells[inside], axis=0)) / (CELLS[0] * CELLS[1])

"""The findings of a calibrated camera: what was left out, what was undecided, what is not covered."""

from __future__ import annotations

from collections.abc import Iterator

from groma.cameras.calibration import DISHONEST, CameraCalibration
from groma.cameras.images import Sightings
from groma.nouns.findings import Finding
from groma.report.words import count, number


def sighting_findings(sightings: Sightings) -> list[Finding]:
    """Return what detection left out."""
    empty, images = len(sightings.empty), len(sightings.names)
    found = [_left_out(f"no target in {empty} of {count(images, 'image')}", empty)] if empty else []
    return found + [_left_out(f"{n} {what}", n) for what, n in sightings.left_out.most_common() if n]


def camera_findings(result: CameraCalibration) -> list[Finding]:
    """Return the findings on a calibrated camera, in the order of their weight."""
    return [*_dishonest(result), *_views(result)]


def _dishonest(result: CameraCalibration) -> Iterator[Finding]:
    factor = result.honesty.factor
    if factor is not None and factor > DISHONEST:
        text = (
            f"halves of the images disagree {number(factor, 1)} times more than the residuals claim; the covariance "
            "that is passed on allows for it"
        )
        yield Finding("model-misfit", text, values={"factor": (factor, "1")})


def _views(result: CameraCalibration) -> Iterator[Finding]:
    if left := len(result.left_out):
        yield _left_out(f"{count(left, 'view')} with too few corners, or that no pose explains", left)
    undecided = sum(not view.decided for view in result.views)
    if undecided:
        yield _left_out(f"of {count(undecided, 'view')} a mirrored pose fits nearly as well", undecided)


def _left_out(text: str, size: int) -> Finding:
    return Finding("views-left-out", text, values={"count": (size, "1")})

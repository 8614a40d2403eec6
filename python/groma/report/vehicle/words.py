"""A calibrated vehicle in words: parameters in the units that read best, the verdict in a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping

from groma.report.words import count, number
from groma.vehicle.recording import CalibratedVehicle, more_driving

WORDS: Mapping[str, str] = {
    "drive_scale": "travel of the driven wheel",
    "wheelbase": "wheelbase",
    "steering_gain": "gain of the steering",
    "steering_offset": "steering offset",
    "steering_offset_forward": "steering offset, forward",
    "steering_offset_backward": "steering offset, backward",
    "left_radius": "radius of the left wheel",
    "right_radius": "radius of the right wheel",
    "axle": "wheel separation",
    "laser_x": "laser ahead",
    "laser_y": "laser to the left",
    "laser_yaw": "laser turned",
    "delay": "wheels later than scans",
}
"""What a parameter is."""
_SCALES = ("drive_scale", "left_radius", "right_radius")
_ANGLES = ("steering_offset", "steering_offset_forward", "steering_offset_backward", "laser_yaw")
_MOST_DIGITS = 7


def unit_of(name: str, result: CalibratedVehicle) -> tuple[float, str]:
    """Return the factor from SI and the unit in which a parameter is shown."""
    if name in _ANGLES:
        return 180 / math.pi, "°"
    if name in _SCALES:
        wheels = result.data.wheels
        made = not wheels.joints
        return (1.0, "") if made else (1e3, "mm" if wheels.unit == "rad" else "mm/tick")
    if name == "steering_gain":
        return 1.0, ""
    return (1e3, "ms") if name == "delay" else (1e3, "mm")


def amount(name: str, value: float, sigma: float, result: CalibratedVehicle) -> str:
    """Return a value with as many digits as its standard deviation warrants."""
    factor, unit = unit_of(name, result)
    if not math.isfinite(value):
        return "undetermined"
    gap = "" if unit in ("", "°") else "\N{NO-BREAK SPACE}"
    return f"{number(value * factor, _digits(sigma * factor))}{gap}{unit}"


def _digits(sigma: float) -> int:
    if not (math.isfinite(sigma) and sigma > 0):
        return 3
    return min(max(0, 1 - math.floor(math.log10(sigma))), _MOST_DIGITS)


def rows(result: CalibratedVehicle) -> list[list[str]]:
    """Return name, value, half-width, tolerance and judgement of every estimated parameter."""
    found, widths = result.found, result.half_widths
    out = []
    for name, value, sigma in zip(found.names, found.values.tolist(), found.sigmas.tolist(), strict=True):
        width = widths[name]
        wanted = result.tolerances.get(name)
        judgement = "" if wanted is None else ("met" if width <= wanted else "not met")
        shown = amount(name, value, sigma, result) if math.isfinite(width) else "undetermined"
        told = f"± {amount(name, width, sigma, result)}" if math.isfinite(width) else ""
        tolerance = amount(name, wanted, wanted, result) if wanted else ""
        out.append([WORDS[name], shown, told, tolerance, judgement])
    return out


def verdict_words(result: CalibratedVehicle) -> str:
    """Return one sentence: undetermined parameters, whether the tolerances are met, how much more to drive."""
    found, used = result.found, int(result.data.counts["motions used"])
    what = "arcs" if result.data.segments.kind == "stop and go" else "windows"
    basis = f"{found.model.capitalize()} drive calibrated from {count(used, 'motion')} ({what})"
    if found.weak:
        return f"The drive does not determine all parameters: {found.weak[0].words}"
    if not result.tolerances:
        misfit = ". The model does not fit: do not use the laser pose" if misfits(result) else ""
        return f"{basis}{misfit}"
    if result.verdict.enough:
        met = (
            "the tolerance is met"
            if len(result.tolerances) == 1
            else f"all {len(result.tolerances)} tolerances are met"
        )
        return f"{basis}: {met}"
    missed = ", ".join(WORDS[name] for name in result.verdict.missed)
    factor = more_driving(result)
    more = f"drive about {number(factor, 1)} times as much of the same" if factor < 50 else "drive something else"
    return f"Not yet within tolerance: {missed}; {more}"


def misfits(result: CalibratedVehicle) -> list[str]:
    """Return how the residuals contradict the model, in sentences."""
    return [finding.text for finding in result.findings if finding.code == "model-misfit"]

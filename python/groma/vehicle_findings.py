"""What a calibrated vehicle says of itself, as findings: open parameters, misfits, tolerances, what was left out."""

from __future__ import annotations

from collections.abc import Iterator

from groma.findings import Finding
from groma.io.left_out import left_out
from groma.report.calibration_words import WORDS, amount, misfits
from groma.report.words import number
from groma.vehicle_calibration import CalibratedVehicle, more_driving
from groma.vehicle_data import VehicleData

USED = "motions used"
"""The one count that is nothing left out."""


def data_findings(data: VehicleData) -> list[Finding]:
    """Return what was chosen and left out while a recording was read for calibration."""
    counts = {reason: count for reason, count in sorted(data.counts.items()) if reason != USED}
    return [*data.notes, *left_out(counts)]


def vehicle_findings(result: CalibratedVehicle) -> list[Finding]:
    """Return the findings on a calibrated vehicle, in the order of their weight."""
    return [
        *(Finding("parameter-open", weak.words) for weak in result.found.weak),
        *(Finding("model-misfit", words) for words in misfits(result)),
        *(() if result.found.weak else result.vehicle.handedness()),
        *_missed(result),
        *(Finding("parameters-assumed", words) for words in result.found.notes),
        *data_findings(result.data),
    ]


def _missed(result: CalibratedVehicle) -> Iterator[Finding]:
    if result.verdict.enough or result.found.weak:
        return
    factor = more_driving(result)
    more = f"drive about {number(factor, 1)} times as much of the same" if factor < 50 else "drive something else"
    told = [f"{WORDS[name]} ± {_shown(name, result.half_widths[name], result)}" for name in result.verdict.missed]
    values = {name: (result.half_widths[name], _UNITS.get(name, "m")) for name in result.verdict.missed}
    yield Finding("tolerance-missed", f"not yet within tolerance: {', '.join(told)}; {more}", values=values)


def _shown(name: str, width: float, result: CalibratedVehicle) -> str:
    return amount(name, width, width, result)


_UNITS = {
    "steering_gain": "1",
    "steering_offset": "rad",
    "steering_offset_forward": "rad",
    "steering_offset_backward": "rad",
    "laser_yaw": "rad",
    "delay": "s",
}
"""Of the half-widths; the others are lengths."""

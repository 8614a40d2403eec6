"""The run of a calibration: a vehicle calibrated from a recording, into the folder of a run."""

from __future__ import annotations

from dataclasses import asdict

import msgspec

from groma.errors import UserError
from groma.io.quantities import amounts
from groma.io.recording import Recording
from groma.io.streams import Kind
from groma.report.vehicle.figures import calibration_figures
from groma.report.vehicle.report import calibration_report
from groma.report.vehicle.words import rows, verdict_words
from groma.runs.run import Run
from groma.runs.settings import Settings
from groma.runs.vehicle_files import save_calibration
from groma.vehicle.recording import CalibratedVehicle, Request, calibrate_vehicle, judged


def calibrate_into(run: Run, recording: Recording, request: Request, tolerance: str = "") -> CalibratedVehicle:
    """Calibrate a vehicle and finish the run with it.

    Raises
    ------
    EstimationError
        When too few motions are left.
    """
    settings = {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(request).items()}
    run.settings = {"calibrate": {**settings, "tolerance": tolerance}}
    with run.stage("scans", _count(recording, request.scans)) as show:
        result = calibrate_vehicle(recording, request, show, run.token)
    if tolerance:
        values = dict(zip(result.found.names, result.found.values.tolist(), strict=True))
        result = judged(result, amounts(tolerance, values, "--tolerance"))
    run.extend(result.findings)
    if not result.found.weak:
        run.extend(result.vehicle.handedness())
    save_calibration(result, run.folder)
    for line in _table(result):
        run.say(line)
    headline = f"{verdict_words(result)}."
    run.finish(calibration_figures(result), headline, lambda outcome: calibration_report(result, outcome))
    return result


def request_of(settings: Settings) -> Request:
    """Return the request of a table [calibrate].

    Raises
    ------
    UserError
        When a value has not the form of an option.
    """
    given = {name: value for name, value in settings.items() if name != "tolerance"}
    try:
        return msgspec.convert(given, Request)
    except msgspec.ValidationError as error:
        raise UserError(f"setting of calibrate: {error}") from error


def _count(recording: Recording, scans: str | None) -> int | None:
    counts = [s.count for s in recording.streams if s.kind is Kind.SCAN and scans in (None, s.name)]
    return max((count for count in counts if count is not None), default=None)


def _table(result: CalibratedVehicle) -> list[str]:
    table = rows(result)
    widths = [max(len(row[k]) for row in table) for k in range(5)]
    return [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in table
    ]

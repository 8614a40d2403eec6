"""The run of a localization: a drive localized in a map, into the folder of a run."""

from __future__ import annotations

from groma.localization.drive import Request, localize_drive
from groma.localization.result import Localized
from groma.recordings.drive import Drive
from groma.report.localization.figures import localization_figures
from groma.report.localization.report import localization_report, localization_verdict
from groma.runs.localization_files import save_localized
from groma.runs.run import Run


def localize_into(run: Run, drive: Drive, request: Request) -> Localized:
    """Localize a drive and finish the run with it.

    Raises
    ------
    EstimationError
        When no scan could be used.
    """
    run.gather(drive.findings)
    count = next((stream.count for stream in drive.recording.streams if stream.name == drive.scans), None)
    with run.stage("scans", count) as show:

        def told(scans: int, status: str, sigma: float) -> None:
            show(scans, f"{status}, sigma {1000 * sigma:.0f} mm")

        result = localize_drive(drive, request, told)
    run.extend(result.findings)
    save_localized(result, run.folder)
    headline = f"{localization_verdict(result)}."
    run.finish(localization_figures(result), headline, lambda outcome: localization_report(result, outcome))
    return result

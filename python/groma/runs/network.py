"""The run of a camera map: a survey mapped, into the folder of a run."""

from __future__ import annotations

from groma.cameras.network import NetworkMapper
from groma.cameras.survey import NetworkRecording
from groma.errors import EstimationError
from groma.nouns.network import NetworkMap
from groma.report.network.figures import network_figures
from groma.report.network.report import network_report
from groma.report.network.words import network_verdict
from groma.runs.network_files import save_network
from groma.runs.run import Run
from groma.runs.settings import Settings


def map_network_into(run: Run, recording: NetworkRecording, settings: Settings) -> NetworkMap:
    """Map the cameras of a survey and finish the run with them.

    Raises
    ------
    EstimationError
        When no camera can be placed.
    """
    run.inputs["input"] = recording.path
    run.settings = {"cameras": settings}
    run.gather(recording.notes.findings)
    recording.cache, recording.keep = run.place, run.folder
    mapper = NetworkMapper(recording.target, recording.cameras)
    with run.stage("messages") as show:
        for count, (message, stop) in enumerate(run.until_cancelled(recording.messages()), 1):
            mapper.push(message, stop)
            show(count)
    try:
        # Who interrupted the reading wants the map of what was read.
        network = mapper.finish(settings, token=None if run.token.cancelled else run.token)
    except EstimationError as error:
        raise EstimationError(f"{recording.path}: {error}") from error
    if not network.cameras:
        raise EstimationError(f"{recording.path}: no camera saw the target well enough to be placed")
    run.extend(network.findings)
    save_network(network, run.folder)
    run.finish(network_figures(network), network_verdict(network), lambda outcome: network_report(network, outcome))
    return network

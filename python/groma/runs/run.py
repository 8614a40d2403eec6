"""One run of a command: a folder that appears whole or not at all, and the findings that are told everywhere alike.

    with Run("map", "map", output) as run:
        recording = run.open(file)
        ...                                 # long work takes run.token, shows its progress with run.stage(...)
        run.note(Finding(...))
        run.write_text("some.csv", ...)
        run.finish(figures, headline, page)

What ends the block decides what is left:

    finished                  the folder with metrics.json, run.toml, report.html; findings on standard error
    finished, an error found  the same, and ToldError: the command exits with 1
    EstimationError           a folder with report, findings and figures but without any file of an estimate; ToldError
    anything else             nothing: what was in the place before is untouched

Ctrl-C cancels the token: reading ends, the run is finished with what was read, and its verdict is ``interrupted``;
where nothing had come of it yet, nothing is left and KeyboardInterrupt tells so. A second Ctrl-C ends the process at
once.
"""

from __future__ import annotations

import errno
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from groma._core import Token
from groma.errors import EstimationError, ToldError, UserError
from groma.io.atomic import write_bytes, write_text
from groma.io.recording import Recording, open_recording
from groma.io.toml import to_toml
from groma.nouns.findings import Finding, verdict
from groma.report.finding_lines import in_order, line
from groma.report.outcome import Json, Outcome, document, to_json
from groma.report.run import plain_report
from groma.runs.interrupts import cancelling
from groma.runs.latest import point_latest
from groma.runs.ownership import RECORD, files_below
from groma.runs.place import Place
from groma.runs.progress import Show, stage
from groma.runs.reading import Watched
from groma.runs.record import printable, run_record, shown_command

T = TypeVar("T")
Page = Callable[[Outcome], str]
METRICS, REPORT = "metrics.json", "report.html"
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO)
_INTERRUPTED = "the run was ended by a signal before everything was read"


class Run:
    """The run of a command.

    Parameters
    ----------
    kind
        What it makes: ``map``, ``localization``, ... (docs/reference/findings.md).
    name
        The command, without ``groma``.
    output
        The folder; None: a new one in `results`, to which `latest` and `latest-KIND` point then.
    settings
        Every setting, by table; may be completed until the block ends.
    command
        The command line to record; that of the process when left out.
    folder
        Whether there is a folder at all; findings are told without one too.
    within
        The run of which this one is a part: its token is shared, and it tells what is to be told.
    """

    def __init__(
        self,
        kind: str,
        name: str,
        output: Path | None = None,
        *,
        settings: Mapping[str, object] | None = None,
        command: str | None = None,
        folder: bool = True,
        within: Run | None = None,
    ) -> None:
        self.kind, self.name = kind, name
        self.settings: dict[str, object] = dict(settings or {})
        self.inputs: dict[str, Path | None] = {"input": None}
        """What was read, by what it was used for."""
        self.token: Token = within.token if within else Token()
        self.findings: list[Finding] = []
        self.outcome: Outcome | None = None
        """What the run came to; there when the block has ended."""
        self._output, self._has_folder, self._within = output, folder, within
        self._command = shown_command(sys.argv[1:]) if command is None else command
        self._place: Place | None = None
        self._stack = ExitStack()
        self._sources: list[Callable[[], Iterable[Finding]]] = []
        self._said: list[str] = []
        self._figures: Mapping[str, object] | None = None
        self._headline, self._page = "", plain_report(name)
        self._was_cancelled = False
        self._report: Path | None = None
        self._as_json = False

    def __enter__(self) -> Self:
        """Check the place and begin a folder beside it.

        Raises
        ------
        UserError
            When there can be no folder.
        """
        with ExitStack() as stack:
            if self._within is None:
                stack.enter_context(cancelling(self.token))
            self._place = Place(self._output) if self._has_folder else None
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the whole folder or nothing, and tell the findings.

        Raises
        ------
        ToldError
            When an error was found: it has been told.
        UserError
            When the folder cannot be written.
        """
        with self._stack:
            try:
                self._end(error)
            except OSError as failure:
                if failure.errno not in _DISK or self._place is None:
                    raise
                raise UserError(f"{self._place.shown}: cannot be written ({failure.strerror})") from failure
            finally:
                if self._place is not None:
                    self._place.abandon()

    # What a command does with its run.

    def open(self, path: Path, what: str = "input") -> Recording:
        """Open a recording whose reading ends when the run is interrupted, and record it as an input."""
        self.inputs[what] = path
        recording = Watched(open_recording(path), self.token)
        self.gather(lambda: recording.notes.findings())
        return recording

    def until_cancelled(self, items: Iterable[T]) -> Iterator[T]:
        """Yield items until there are no more or the run is interrupted."""
        for item in items:
            if self.token.cancelled:
                return
            yield item

    def whole(self, items: Iterable[T]) -> Iterator[T]:
        """Yield all items, for a file that must not end early.

        Raises
        ------
        KeyboardInterrupt
            When the run is interrupted on the way.
        """
        for item in items:
            if self.token.cancelled:
                raise KeyboardInterrupt
            yield item

    def stage(self, unit: str, total: int | None = None) -> AbstractContextManager[Show]:
        """Show the progress of a stage of the work; see :func:`groma.runs.progress.stage`."""
        return stage(unit, total)

    def note(self, finding: Finding) -> None:
        """Keep a finding, once."""
        clean = replace(finding, text=printable(finding.text))
        if clean not in self.findings:
            self.findings.append(clean)

    def extend(self, findings: Iterable[Finding]) -> None:
        """Keep findings."""
        for finding in findings:
            self.note(finding)

    def gather(self, source: Callable[[], Iterable[Finding]]) -> None:
        """Ask for findings when the block ends, also where there is no estimate."""
        self._sources.append(source)

    def say(self, text: str) -> None:
        """Keep a line for standard output."""
        self._said.append(text)

    @property
    def folder(self) -> Path:
        """The folder in which the files of the run are made; its name is not that of the place."""
        if self._place is None:
            raise RuntimeError("a run without a folder has no files")
        return self._place.made

    @property
    def is_new(self) -> bool:
        """Whether the folder is a new one in `results`, not one that the user named."""
        return self._output is None

    @property
    def place(self) -> Path:
        """Where the folder is in the end, as the user calls it."""
        if self._place is None:
            raise RuntimeError("a run without a folder has no place")
        return self._place.shown

    def path(self, name: str) -> Path:
        """Return the path of a file to be written; folders in its name are made."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def write_text(self, name: str, text: str) -> None:
        """Write a file of text."""
        write_text(self.path(name), text)

    def write_bytes(self, name: str, data: bytes) -> None:
        """Write a file of bytes."""
        write_bytes(self.path(name), data)

    def finish(
        self, figures: Mapping[str, object], headline: str = "", page: Page | None = None, *, as_json: bool = False
    ) -> None:
        """Say what came out; files and report are written when the block ends.

        Parameters
        ----------
        figures
            The content of metrics.json beside kind, verdict and findings.
        headline
            What came out, in a sentence or two.
        page
            Makes the report; one that shows headline and findings when left out.
        as_json
            Print the content of metrics.json instead of lines for a person.
        """
        self._as_json = as_json
        self._figures, self._headline = figures, headline
        self._page = page or self._page
        self._was_cancelled = self.token.cancelled

    # How it ends.

    def _end(self, error: BaseException | None) -> None:
        if isinstance(error, OSError) and error.errno in _DISK:
            raise error
        if error is None and self._figures is None:
            raise RuntimeError(f"groma {self.name} did not finish its run")
        if isinstance(error, EstimationError) and not isinstance(error, ToldError):
            if self.token.cancelled:
                raise KeyboardInterrupt from error
            self._without_estimate(error)
        elif error is None:
            self._leave()

    def _without_estimate(self, error: EstimationError) -> None:
        if self._place is not None:
            self._place.empty()
        self.note(Finding("no-estimate", str(error)))
        self._figures, self._page = {}, plain_report(self.name)
        self._headline = f"There is no estimate: {error}"
        self._leave()

    def _leave(self) -> None:
        """Write what is the same for all runs, put the folder into its place, tell."""
        for source in self._sources:
            self.extend(source())
        if self._was_cancelled and all(finding.code != "interrupted" for finding in self.findings):
            self.note(Finding("interrupted", _INTERRUPTED))
        self.findings = in_order(self.findings)
        self.outcome = self._outcome()
        if self._place is not None:
            self._write(self.outcome)
            place = self._place.install()
            self._place = None
            if self._output is None and self._within is None:
                point_latest(place, self.kind)
            self._report = place / REPORT
        if self._within is not None:
            self._within.extend(replace(finding, text=f"{self.name}: {finding.text}") for finding in self.findings)
            return
        self._tell(self.outcome)
        if self.findings and self.findings[0].severity == "error":
            raise ToldError(self.findings[0].text)

    def _outcome(self) -> Outcome:
        judged = verdict(self.kind, self.findings)
        headline = printable(self._headline)
        if judged == "interrupted":
            headline = f"Interrupted: this is what had been read until then. {headline}".strip()
        record = run_record(self.kind, self._command, self.inputs, self.settings, self.token)
        if self._place is not None:
            record["files"] = sorted({*files_below(self.folder), METRICS, RECORD, REPORT})
        return Outcome(self.kind, judged, tuple(self.findings), headline, record)

    def _write(self, outcome: Outcome) -> None:
        self.write_text(METRICS, to_json(self._document(outcome)))
        self.write_text(RECORD, to_toml(outcome.record))
        self.write_text(REPORT, self._page(outcome))

    def _document(self, outcome: Outcome) -> Json:
        return document(outcome.kind, outcome.verdict, outcome.findings, self._figures or {})

    def _tell(self, outcome: Outcome) -> None:
        for finding in outcome.findings:
            sys.stderr.write(f"{line(finding)}\n")
        if self._as_json:
            sys.stdout.write(to_json(self._document(outcome)))
            return
        for text in (*self._said, outcome.headline, self._report):
            if text:
                sys.stdout.write(f"{text}\n")

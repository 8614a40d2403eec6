"""What a reader met: skipped, malformed, assumed, as findings. Nothing is dropped without being counted.

Counts belong to one pass over a recording; a new pass starts them anew. Assumptions belong to the recording and stay.
Findings are those of all passes: commands read some streams in one pass and others in the next, and a pass may end
early. A tag or reason counts as often as in the pass that met it most; malformed records count once each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice

from groma.nouns.bounds import OutOfRangeError
from groma.nouns.findings import Finding

KEPT = 5
"""Malformed records that are told one by one; the rest is only counted."""
MOST = 10_000
"""Malformed records that are distinguished over several passes."""


@dataclass(slots=True)
class Notes:
    """Counters and findings, filled while a recording is read."""

    assumptions: list[Finding] = field(default_factory=list)
    """What the format leaves open and how it was taken."""
    skipped: Counter[str] = field(default_factory=Counter)
    """Records that are none of ours, by tag or type."""
    malformed: int = 0
    examples: list[str] = field(default_factory=list)
    """The first malformed records: ``file:line: reason``."""
    beams: Counter[str] = field(default_factory=Counter)
    """Readings that are no range, by reason."""
    angle_max_excess: dict[str, float] = field(default_factory=dict)
    """By stream: how many beams too many (or too few) ``angle_max`` counts, where it is more than half a beam."""
    cut: str = ""
    """Where and why reading ended early; empty when the file was read to its end."""
    _skipped_before: Counter[str] = field(default_factory=Counter)
    _beams_before: Counter[str] = field(default_factory=Counter)
    _rejected: dict[str, str] = field(default_factory=dict)
    """Malformed records of all passes by their place, `MOST` at most."""
    _invalid: set[str] = field(default_factory=set)
    """Places of those that read well, but say a number that is not finite or out of its bound."""
    _most_malformed: int = 0
    _cut_before: str = ""

    def restart(self) -> None:
        """Begin the counts of a new pass."""
        self._skipped_before |= self.skipped
        self._beams_before |= self.beams
        self._cut_before = self.cut or self._cut_before
        self.skipped.clear()
        self.beams.clear()
        self.examples.clear()
        self.malformed = 0
        self.cut = ""

    def skip(self, tag: str) -> None:
        """Count a record of another tool."""
        self.skipped[tag] += 1

    def reject(self, where: str, reason: str, error: Exception | None = None) -> None:
        """Count a malformed record, or one with a number out of its bound; the first few are kept in words."""
        self.malformed += 1
        if isinstance(error, OutOfRangeError) and len(self._invalid) < MOST:
            self._invalid.add(where)
        self._most_malformed = max(self._most_malformed, self.malformed)
        if len(self._rejected) < MOST:
            self._rejected.setdefault(where, reason)
        if len(self.examples) < KEPT:
            self.examples.append(f"{where}: {reason}")

    def assume(self, text: str, code: str = "assumption") -> None:
        """Keep what the format leaves open and how it was taken, once."""
        self.take(Finding(code, text))

    def take(self, finding: Finding) -> None:
        """Keep a finding that belongs to the recording, once."""
        if finding not in self.assumptions:
            self.assumptions.append(finding)

    def findings(self) -> list[Finding]:
        """Return everything, in a fixed order."""
        return [
            *self.assumptions,
            *self._beam_counts(),
            *self._cut(),
            *self._skipped(),
            *self._readings(),
            *self._bad(),
        ]

    def _beam_counts(self) -> Iterator[Finding]:
        for stream, excess in self.angle_max_excess.items():
            yield Finding("beam-count", f"{stream}: {fence_post(excess)}", values={"excess": (excess, "1")})

    def _cut(self) -> Iterator[Finding]:
        if cut := self.cut or self._cut_before:
            yield Finding("recording-cut", cut)

    def _skipped(self) -> Iterator[Finding]:
        if skipped := self.skipped | self._skipped_before:
            yield _counted("records-skipped", "skipped", skipped)

    def _readings(self) -> Iterator[Finding]:
        if beams := self.beams | self._beams_before:
            yield _counted("readings-invalid", "readings that are no range", beams)

    def _bad(self) -> Iterator[Finding]:
        invalid = {where: reason for where, reason in self._rejected.items() if where in self._invalid}
        malformed = {where: reason for where, reason in self._rejected.items() if where not in self._invalid}
        if size := max(self._most_malformed, len(self._rejected)) - len(invalid):
            yield _rejected("records-malformed", "malformed", size, malformed)
        if invalid:
            yield _rejected("values-invalid", "with a number out of its bound", len(invalid), invalid)


def _rejected(code: str, what: str, size: int, reasons: dict[str, str]) -> Finding:
    told = [f"{where}: {reason}" for where, reason in islice(reasons.items(), KEPT)]
    more = f"; and {size - len(told)} more" if size > len(told) else ""
    return Finding(code, f"{size} {what} and left out: {'; '.join(told)}{more}", values={"count": (size, "1")})


def _counted(code: str, what: str, counts: Counter[str]) -> Finding:
    told = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
    return Finding(code, f"{what}: {told}", values={"count": (counts.total(), "1")})


def fence_post(excess: float) -> str:
    """Say in words what a wrong ``angle_max`` counts."""
    count = abs(round(excess, 1))
    beams = "one beam" if count == 1 else f"{count:g} beams"
    direction = "too many" if excess > 0 else "too few"
    return f"angle_max counts {beams} {direction}; beams are counted from angle_min, so this does no harm here"

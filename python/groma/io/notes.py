"""What a reader met: skipped, malformed, assumed, as findings. Nothing is dropped without being counted.

Counts belong to one pass over a recording; a new pass starts them anew. Assumptions belong to the recording and stay.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from groma.findings import Finding

KEPT = 5
"""Malformed records that are told one by one; the rest is only counted."""


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

    def restart(self) -> None:
        """Forget the counts of the pass before."""
        self.skipped.clear()
        self.beams.clear()
        self.examples.clear()
        self.malformed = 0
        self.cut = ""

    def skip(self, tag: str) -> None:
        """Count a record of another tool."""
        self.skipped[tag] += 1

    def reject(self, where: str, reason: str) -> None:
        """Count a malformed record; the first few are kept in words."""
        self.malformed += 1
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
        if self.cut:
            yield Finding("recording-cut", self.cut)

    def _skipped(self) -> Iterator[Finding]:
        if self.skipped:
            yield _counted("records-skipped", "skipped", self.skipped)

    def _readings(self) -> Iterator[Finding]:
        if self.beams:
            yield _counted("readings-invalid", "readings that are no range", self.beams)

    def _bad(self) -> Iterator[Finding]:
        if self.malformed:
            told = "; ".join(self.examples)
            more = f"; and {self.malformed - len(self.examples)} more" if self.malformed > len(self.examples) else ""
            text = f"{self.malformed} malformed and left out: {told}{more}"
            yield Finding("records-malformed", text, values={"count": (self.malformed, "1")})


def _counted(code: str, what: str, counts: Counter[str]) -> Finding:
    told = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
    return Finding(code, f"{what}: {told}", values={"count": (counts.total(), "1")})


def fence_post(excess: float) -> str:
    """Say in words what a wrong ``angle_max`` counts."""
    count = abs(round(excess, 1))
    beams = "one beam" if count == 1 else f"{count:g} beams"
    direction = "too many" if excess > 0 else "too few"
    return f"angle_max counts {beams} {direction}; beams are counted from angle_min, so this does no harm here"

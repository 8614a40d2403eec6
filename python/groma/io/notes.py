"""What a reader met that a person should know: skipped, malformed, assumed. Nothing is dropped without being counted.

Counts belong to one pass over a recording; a new pass starts them anew. Assumptions belong to the recording and stay.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

KEPT = 5
"""Malformed records that are told one by one; the rest is only counted."""


@dataclass(slots=True)
class Notes:
    """Counters and remarks, filled while a recording is read."""

    assumptions: list[str] = field(default_factory=list)
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

    def assume(self, text: str) -> None:
        """Keep an assumption, once."""
        if text not in self.assumptions:
            self.assumptions.append(text)

    def lines(self) -> list[str]:
        """Return everything as sentences, in a fixed order."""
        told = list(self.assumptions)
        told.extend(f"{stream}: {fence_post(excess)}" for stream, excess in self.angle_max_excess.items())
        if self.cut:
            told.append(self.cut)
        if self.skipped:
            told.append("skipped: " + ", ".join(f"{n} x {tag}" for tag, n in sorted(self.skipped.items())))
        if self.beams:
            told.append(
                "readings that are no range: " + ", ".join(f"{n} {why}" for why, n in sorted(self.beams.items()))
            )
        if self.malformed:
            told.append(f"malformed and left out: {self.malformed}")
            told.extend(f"  {example}" for example in self.examples)
        return told


def fence_post(excess: float) -> str:
    """Say in words what a wrong ``angle_max`` counts."""
    count = abs(round(excess, 1))
    beams = "one beam" if count == 1 else f"{count:g} beams"
    direction = "too many" if excess > 0 else "too few"
    return f"angle_max counts {beams} {direction}; beams are counted from angle_min, so this does no harm here"

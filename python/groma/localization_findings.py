"""What a localized drive says of itself, as findings: never found, lost, weakly held, contradicted by the map."""

from __future__ import annotations

from collections.abc import Iterator

from groma.findings import Finding
from groma.localized import Localized, Weak
from groma.report.words import duration, length, place

MOST = 10
"""Stretches of a kind that are told one by one, the longest; the others are counted."""
_CODES = {"the pose is not known": "pose-lost", "the landmarks disagree": "landmarks-disagree"}
_ELSE = "weak-stretch"


def localization_findings(result: Localized) -> list[Finding]:
    """Return the findings on a localized drive, in the order of their weight."""
    if result.found_after is None:
        return [Finding("never-found", "no place of the map fits what the vehicle saw")]
    found: list[Finding] = []
    for code in dict.fromkeys([*_CODES.values(), _ELSE]):
        found += _stretches(code, [spot for spot in result.weak if _CODES.get(spot.why, _ELSE) == code], result)
    return found


def _stretches(code: str, spots: list[Weak], result: Localized) -> Iterator[Finding]:
    longest_first = sorted(spots, key=lambda spot: spot.from_stamp - spot.to_stamp)
    for spot in longest_first[:MOST]:
        yield _stretch(code, spot, float(result.stamps[0]))
    if others := longest_first[MOST:]:
        text = f"{len(others)} more stretches like these, none longer"
        yield Finding(code, text, values={"stretches": (len(others), "1")})


def _stretch(code: str, spot: Weak, start: float) -> Finding:
    when = f"{duration(spot.from_stamp - start)} to {duration(spot.to_stamp - start)}"
    text = f"{when}, near {place(spot.xy)}: {spot.why}"
    values = {"sigma": (spot.sigma_m, "m")}
    if code == _ELSE:
        text += f" (σ {length(spot.sigma_m)})"
    return Finding(code, text, (spot.from_stamp, spot.to_stamp), spot.xy, values)

"""Numbers and judgements in words, for people: unlike the files, in the unit that reads best."""

from __future__ import annotations

import math

NOTHING = 1e-6
"""Lengths [m] and counts of pixels below this are rounding errors, and told as zero."""


def length(metres: float) -> str:
    """Return a length in millimetres, centimetres or metres, to two digits (three in metres)."""
    if not math.isfinite(metres):
        return "–"
    metres = metres if abs(metres) >= NOTHING else 0.0
    size = float(f"{abs(metres):.2g}")
    for below, factor, digits, unit in ((0.01, 1000, 2, "mm"), (1, 100, 2, "cm"), (1000, 1, 3, "m")):
        if size < below:
            value = f"{metres * factor:#.{digits}g}".rstrip(".").replace("-", "\N{MINUS SIGN}")
            return f"{value}\N{NO-BREAK SPACE}{unit}"
    return f"{number(metres, 0)}\N{NO-BREAK SPACE}m"


def angle(radians: float) -> str:
    """Return an angle in degrees."""
    return f"{number(math.degrees(radians), 2)}°" if math.isfinite(radians) else "–"


def pixels(size: float) -> str:
    """Return a length in an image."""
    return f"{short(size)}\N{NO-BREAK SPACE}px" if math.isfinite(size) else "–"


def short(value: float) -> str:
    """Return a number to two digits, or to all before the point; rounding errors are zero."""
    value = value if abs(value) >= NOTHING else 0.0
    return number(value, 0) if abs(value) >= 10 else f"{value:.2g}".replace("-", "\N{MINUS SIGN}")


def duration(seconds: float) -> str:
    """Return a time as hours, minutes and seconds."""
    if not math.isfinite(seconds):
        return "–"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def place(xy: tuple[float, float]) -> str:
    """Return a place in the map."""
    return f"({number(xy[0], 1)},\N{NO-BREAK SPACE}{number(xy[1], 1)})"


def number(value: float, digits: int) -> str:
    """Return a number with a true minus, and without one before zero."""
    text = f"{value:.{digits}f}"
    return text.replace("-", "\N{MINUS SIGN}") if float(text) else text.removeprefix("-")


def count(size: int, noun: str) -> str:
    """Return `3 closures`, `1 closure`, `no closure`."""
    return f"no {noun}" if size == 0 else f"{size} {noun}{'' if size == 1 else 's'}"


def bearing(radians: float) -> str:
    """Return the direction of a line in the map, 0..180 degrees from the x axis."""
    return f"{round(math.degrees(radians)) % 180}°"

"""Amounts with units on the command line: ``laser_x=2mm,laser_yaw=0.05deg,drive_scale=0.01%``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from groma.errors import UserError

UNITS: Mapping[str, float] = {
    "": 1.0,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "rad": 1.0,
    "deg": math.pi / 180,
    "s": 1.0,
    "ms": 1e-3,
}
PERCENT = "%"
_ITEM = re.compile(r"\s*(\w+)\s*=\s*([0-9.eE+-]+?)\s*([a-z]*|%)\s*")


def amounts(text: str, values: Mapping[str, float], option: str) -> dict[str, float]:
    """Return named amounts in SI units.

    Parameters
    ----------
    text
        ``name=number[unit]``, separated by commas; ``%`` is of the value of that name.
    values
        The names there are, with their values.
    option
        What to call it in a message.

    Raises
    ------
    UserError
        When a name or a unit is unknown, or a number is none or not above 0.
    """
    return dict(_amount(item, values, option) for item in text.split(","))


def _amount(item: str, values: Mapping[str, float], option: str) -> tuple[str, float]:
    found = _ITEM.fullmatch(item)
    if found is None:
        raise UserError(f"{option} {item.strip()}: is name=number with a unit ({', '.join(filter(None, UNITS))} or %)")
    name, number, unit = found.groups()
    if name not in values:
        raise UserError(f"{option} {name}: there are {', '.join(values)}")
    if unit != PERCENT and unit not in UNITS:
        raise UserError(f"{option} {name}: the unit {unit} is none of {', '.join(filter(None, UNITS))}, %")
    factor = abs(values[name]) / 100 if unit == PERCENT else UNITS[unit]
    try:
        amount = float(number) * factor
    except ValueError:
        raise UserError(f"{option} {name}: {number} is no number") from None
    if not (math.isfinite(amount) and amount > 0):
        raise UserError(f"{option} {name}: must be above 0")
    return name, amount

"""What numbers a message, a map or a file may bring in: the bounds of the core, checked by field.

A number outside of its bound has the wrong unit or is an accident. The bounds stand once, in the crate ``models``
(``bounds``), where each says why; readers count or refuse what is outside, by file, line or message.

>>> require("coordinate", "x", 2.5)
>>> require("coordinate", "x", float("nan"))
Traceback (most recent call last):
groma.nouns.bounds.OutOfRangeError: x = nan: must be within 1e7 m of the origin
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from groma import _core
from groma.errors import UserError


class OutOfRangeError(ValueError):
    """A number that is not finite or out of its bound; the message names field, value and rule."""


class Bound(NamedTuple):
    """An interval of allowed values, ends included."""

    low: float
    high: float
    rule: str


BOUNDS = {name: Bound(low, high, rule) for name, low, high, rule in _core.bounds()}
"""By name of the quantity."""


def is_within(bound: str, value: float) -> bool:
    """Return whether a number is inside of a bound; NaN never is."""
    low, high, _ = BOUNDS[bound]
    return low <= value <= high


def are_within(bound: str, table: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which rows (N,) of a table (N, k) have all numbers inside of a bound."""
    low, high, _ = BOUNDS[bound]
    inside: NDArray[np.bool_] = np.logical_and.reduce((table >= low) & (table <= high), axis=1)
    return inside


def require(bound: str, field: str, value: float) -> None:
    """Refuse a number outside of a bound.

    Raises
    ------
    OutOfRangeError
        Naming the field, the value and the rule.
    """
    low, high, rule = BOUNDS[bound]
    if not low <= value <= high:
        raise OutOfRangeError(f"{field} = {value:g}: {rule}")


def require_all(bound: str, field: str, values: ArrayLike, *, or_nan: bool = False) -> None:
    """Refuse an array with a number outside of a bound; NaN may represent "unknown" where ``or_nan`` says so.

    Raises
    ------
    OutOfRangeError
        Naming the field, the first such value, its place and the rule.
    """
    low, high, rule = BOUNDS[bound]
    array = np.asarray(values, dtype=np.float64)
    inside = (array >= low) & (array <= high)
    if or_nan:
        inside |= np.isnan(array)
    if not inside.all():
        place = tuple(int(k) for k in np.argwhere(~inside)[0])
        at = "".join(f"[{k}]" for k in place)
        raise OutOfRangeError(f"{field}{at} = {array[place]:g}: {rule}")


@contextmanager
def in_file(path: Path, line: int | None = None) -> Iterator[None]:
    """Make a number out of range a mistake in a file, in a line of it.

    Raises
    ------
    UserError
        Naming the file, the field, the value and the rule.
    """
    try:
        yield
    except OutOfRangeError as error:
        raise UserError(f"{path}{'' if line is None else f':{line}'}: {error}") from error

"""Calls of the core by planning: values as JSON, and its refusals as errors of the user."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import msgspec

from groma.errors import UserError

T = TypeVar("T")


def to_json(value: object) -> str:
    """Return a value as JSON.

    Raises
    ------
    UserError
        When a number in it is not finite: JSON has no word for it.
    """
    for number in _numbers(msgspec.to_builtins(value)):
        if not math.isfinite(number):
            raise UserError(f"{number} is no number to plan with: it must be finite")
    return msgspec.json.encode(value).decode()


def call(core: Callable[[], T]) -> T:
    """Return what the core answers.

    Raises
    ------
    UserError
        When it refuses.
    """
    try:
        return core()
    except (ValueError, OverflowError) as error:
        raise UserError(str(error)) from error


def _numbers(value: object) -> list[float]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return [number for part in value for number in _numbers(part)]
    return [value] if isinstance(value, float) else []

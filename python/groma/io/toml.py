"""Settings as TOML text: nested dictionaries of booleans, numbers, strings and lists of these or of tables.

What is unset (None) stands as a comment, for TOML has no word for it. Reading is the standard library's `tomllib`.
Source: toml.io/en/v1.0.0.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def to_toml(values: Mapping[str, object], table: str = "") -> str:
    """Return the text of a table: its plain values first, then its tables, each in the given order.

    Raises
    ------
    TypeError
        For a value that TOML cannot hold.
    """
    plain = {key: value for key, value in values.items() if not isinstance(value, Mapping) and not _is_tables(value)}
    text = f"\n[{table}]\n" if table and (plain or not values) else ""
    text += "".join(_line(key, value) for key, value in plain.items())
    for key, value in values.items():
        if isinstance(value, Mapping):
            text += to_toml(value, f"{table}.{_key(key)}" if table else _key(key))
        elif _is_tables(value):
            name = f"[{table}.{_key(key)}]" if table else f"[{_key(key)}]"
            text += "".join(to_toml(entry, name) for entry in cast(list[Mapping[str, object]], value))
    return text if table else text.removeprefix("\n")


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(isinstance(entry, Mapping) for entry in value)


def _line(key: str, value: object) -> str:
    return f"# {_key(key)} is unset\n" if value is None else f"{_key(key)} = {_value(value)}\n"


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _string(key)


def _value(value: object) -> str:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else f"{value}"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str | Path):
        return _string(str(value))
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    raise TypeError(f"{type(value).__name__} has no place in TOML")


def _string(text: str) -> str:
    """Return a basic string; JSON escapes the same way, but for the delete character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")

"""Settings of a command: the defaults of the core, changed by a TOML file and by the command line.

A file has one table a command, as ``groma config`` prints them, or these below ``[settings]``, as ``run.toml`` has
them. What it leaves out keeps its default, so that the settings are always complete; what it does not know, or what
has another type, is refused with its path. Limits of a value are the business of the core.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path

from groma.errors import UserError

Settings = dict[str, object]


def read_table(config: Path, command: str) -> Mapping[str, object]:
    """Return the settings that a file has for a command.

    Raises
    ------
    UserError
        When the file cannot be read, is not TOML, or has no such table.
    """
    try:
        content: object = tomllib.loads(config.read_text("utf-8"))
    except OSError as error:
        raise UserError(f"{config}: cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{config}: is not TOML: {error}") from error
    if isinstance(content, dict):
        content = content.get("settings", content)
    table = content.get(command) if isinstance(content, dict) else None
    if not isinstance(table, dict):
        raise UserError(f"{config}: has no table [{command}]: `groma config` prints one to start from")
    return table


def chosen(
    defaults: Mapping[str, object],
    config: Path | None,
    command: str,
    options: Mapping[str, object],
    recorded: Collection[str] = (),
) -> Settings:
    """Return the defaults, changed by the table of a command in a file, changed by the options that are not None.

    Parameters
    ----------
    defaults
        All settings there are.
    config
        The file; None for none.
    command
        Name of the table.
    options
        What the command line says; None where it does not.
    recorded
        Keys that run.toml has in the table beside settings: they are passed over.

    Raises
    ------
    UserError
        As :func:`read_table` and :func:`merged`; an option is named as it is written on the command line.
    """
    table = read_table(config, command) if config else {}
    settings = merged(defaults, {key: value for key, value in table.items() if key not in recorded}, command)
    given = {key: value for key, value in options.items() if value is not None}
    return settings | {key: _value(settings[key], value, f"--{key.replace('_', '-')}") for key, value in given.items()}


def merged(defaults: Mapping[str, object], changes: Mapping[str, object], path: str) -> Settings:
    """Return the defaults with the changes in their place, tables within tables.

    Parameters
    ----------
    defaults
        All settings there are.
    changes
        Some of them.
    path
        Name of the table, for the message.

    Raises
    ------
    UserError
        When there is no setting of a name, or its value is of another type; the message has the whole path.
    """
    return _merged(defaults, changes, f"setting {path}")


def _merged(defaults: Mapping[str, object], changes: Mapping[str, object], label: str) -> Settings:
    unknown = [key for key in changes if key not in defaults]
    if unknown:
        raise UserError(f"unknown {label}.{unknown[0]}: there are {', '.join(defaults)}")
    return {key: _value(value, changes.get(key, value), f"{label}.{key}") for key, value in defaults.items()}


def _value(default: object, value: object, label: str) -> object:
    """Return a value of the kind that the default has; the label names it in messages."""
    if isinstance(default, Mapping):
        if not isinstance(value, Mapping):
            raise UserError(f"{label}: is a table, not {value!r}")
        return _merged(default, value, label)
    for kind, name in ((bool, "true or false"), (int, "a whole number"), (float, "a number")):
        if isinstance(default, kind):
            return _of_kind(value, kind, f"{label}: is {name}, not {value!r}")
    return value


def _of_kind(value: object, kind: type, message: str) -> object:
    """Return a value of a kind; a whole number is a number too, a truth value is none."""
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if type(value) is not kind or (isinstance(value, float) and not math.isfinite(value)):
        raise UserError(message)
    return value

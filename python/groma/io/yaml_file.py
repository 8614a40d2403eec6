"""YAML files as values: only what YAML 1.2 itself knows, no tags that make objects."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import msgspec
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from groma.errors import UserError
from groma.io.table import read_bytes

T = TypeVar("T")


def read_yaml(path: Path) -> object:
    """Return the content of a file, plain or gzipped.

    Raises
    ------
    UserError
        When the file cannot be read or is no YAML; the line is named.
    """
    text = read_bytes(path).decode(errors="replace")
    try:
        return YAML(typ="safe", pure=True).load(text.removeprefix("%YAML:1.0").lstrip())
    except YAMLError as error:
        raise UserError(f"{path}: not a yaml file: {' '.join(str(error).split())}") from error
    except ValueError as error:
        raise UserError(f"{path}: not a yaml file: {error}") from error


def converted(path: Path, values: object, kind: type[T], what: str) -> T:
    """Return values as a struct.

    Raises
    ------
    UserError
        When a key is missing or has the wrong type: its path is named, and ``what`` the file is not.
    """
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        raise UserError(f"{path}: not {what}: {error}") from error

"""``vehicle.toml``: a calibrated vehicle, for people to read and for map and localize to use.

    version = 1
    model = "tricycle"
    unit = "rad"
    joints = ["traction_joint", "steering_joint"]

    [parameters]
    drive_scale = 0.12
    ...

    [covariance]
    names = ["drive_scale", ...]
    matrix = [[...], ...]

Numbers read back exactly. A file may be written by hand: without [covariance] the parameters count as given, and
``joints`` may be left out when the recording has no others. Field by field: docs/reference/outputs.md.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.toml import to_toml
from groma.vehicle import JOINTS, PARAMETERS, Array, Model, Vehicle

VERSION = 1
_KEYS = {"version", "model", "unit", "joints", "parameters", "covariance"}
_OPTIONAL = {"delay": 0.0, "steering_gain": 1.0}
"""Parameters that may be left out of a file that is written by hand."""


def write_vehicle(path: Path, vehicle: Vehicle) -> None:
    """Write a vehicle.

    Raises
    ------
    UserError
        When the file cannot be written.
    """
    write_text(path, vehicle_text(vehicle))


def vehicle_text(vehicle: Vehicle) -> str:
    """Return the text of a vehicle file."""
    table: dict[str, object] = {
        "version": VERSION,
        "model": vehicle.model,
        "unit": vehicle.unit,
        "joints": list(vehicle.joints) or None,
        "parameters": {name: float(vehicle.parameters[name]) for name in PARAMETERS[vehicle.model]},
    }
    if vehicle.names:
        table["covariance"] = {"names": list(vehicle.names), "matrix": vehicle.covariance.tolist()}
    return to_toml(table)


def read_vehicle(path: Path) -> Vehicle:
    """Read a vehicle.

    Raises
    ------
    UserError
        When the file cannot be read or does not describe a vehicle; the message says which field is wrong.
    """
    try:
        return _vehicle(tomllib.loads(path.read_text("utf-8")))
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: is not TOML: {error}") from error
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _vehicle(content: Mapping[str, object]) -> Vehicle:
    if unknown := sorted(set(content) - _KEYS):
        raise ValueError(f"unknown key {unknown[0]}: there are {', '.join(sorted(_KEYS))}")
    if content.get("version") != VERSION:
        raise ValueError(f"version {content.get('version')!r}: this groma reads version {VERSION}")
    model, unit = content.get("model"), content.get("unit", "rad")
    if not isinstance(model, str) or model not in PARAMETERS:
        raise ValueError(f"model {model!r}: there are {', '.join(PARAMETERS)}")
    if unit not in ("rad", "tick"):
        raise ValueError(f"unit {unit!r}: is rad or tick")
    joints = _joints(content, model)
    parameters = _parameters(content.get("parameters"), model)
    names, covariance = _covariance(content.get("covariance"), PARAMETERS[model])
    return Vehicle(cast(Model, model), parameters, names, covariance, unit, joints)


def _joints(content: Mapping[str, object], model: str) -> tuple[str, ...]:
    joints = content.get("joints", [])
    if not isinstance(joints, list) or not all(isinstance(name, str) for name in joints):
        raise ValueError("joints: is a list of names")
    if joints and len(joints) != len(JOINTS[model]):
        raise ValueError(f"joints: a {model} has {len(JOINTS[model])}, {' and '.join(JOINTS[model])}")
    return tuple(joints)


def _parameters(table: object, model: str) -> dict[str, float]:
    if not isinstance(table, Mapping):
        raise ValueError("there is no table [parameters]")
    if unknown := [name for name in table if name not in PARAMETERS[model]]:
        raise ValueError(f"unknown parameter {unknown[0]}: a {model} has {', '.join(PARAMETERS[model])}")
    values = {name: table.get(name, _OPTIONAL.get(name)) for name in PARAMETERS[model]}
    for name, value in values.items():
        if value is None:
            raise ValueError(f"the parameter {name} is missing")
        if not _is_number(value):
            raise ValueError(f"the parameter {name} is {value!r}, not a finite number")
    return {name: float(cast(float, value)) for name, value in values.items()}


def _covariance(table: object, parameters: tuple[str, ...]) -> tuple[tuple[str, ...], Array]:
    if table is None:
        return (), np.zeros((0, 0))
    if not isinstance(table, Mapping) or set(table) != {"names", "matrix"}:
        raise ValueError("[covariance]: has names and matrix")
    names, rows = table["names"], table["matrix"]
    if not isinstance(names, list) or not set(names) <= set(parameters) or len(set(names)) != len(names):
        raise ValueError(f"[covariance] names: some of {', '.join(parameters)}, each once")
    size = len(names)
    square = isinstance(rows, list) and len(rows) == size and all(_is_row(row, size) for row in rows)
    if not square:
        raise ValueError(f"[covariance] matrix: is {size} rows of {size} finite numbers")
    matrix = np.array(rows, dtype=np.float64).reshape(size, size)
    if size and (not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0) or not _is_positive(matrix)):
        raise ValueError("[covariance] matrix: is not symmetric and positive")
    return tuple(names), matrix


def _is_row(row: object, size: int) -> bool:
    return isinstance(row, list) and len(row) == size and all(map(_is_number, row))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_positive(matrix: Array) -> bool:
    """Whether no direction has a negative variance, up to rounding; scales of parameters differ by many orders."""
    sigma = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    if not (sigma > 0).all():
        return False
    return bool(np.linalg.eigvalsh(matrix / np.outer(sigma, sigma)).min() > -1e-9)

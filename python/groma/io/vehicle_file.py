"""``vehicle.toml``: a calibrated vehicle, for people to read and for map and localize to use.

    version = 2
    unit = "rad"
    joints = ["traction_joint", "steering_joint"]
    delay = 0.0

    [drive]
    model = "tricycle"
    drive_scale = 0.12
    ...

    [noise]
    slip = 0.0005
    ...

    [[scanners]]
    name = "laser"
    x = 0.39
    ...

    [covariance]
    names = ["drive_scale", ...]
    matrix = [[...], ...]

Numbers read back exactly. A file may be written by hand: without [covariance] the parameters count as given, without
[noise] the wheels are usual ones, and ``joints`` may be left out when the recording has no others. Files of version 1
(groma 0.1), which have one table [parameters] and no noise, are read as well. What a number may be is decided by the
core. Field by field: docs/reference/outputs.md.
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import cast

import numpy as np

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.toml import to_toml
from groma.nouns.arrays import Array
from groma.nouns.vehicle import COMMON, JOINTS, PARAMETERS, Model, Scanner, Unit, Vehicle, WheelNoise, usual_noise

_KEYS = {"version", "unit", "joints", "delay", "drive", "noise", "scanners", "covariance"}
_KEYS_1 = {"version", "model", "unit", "joints", "parameters", "covariance"}
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
    tree = vehicle.tree()
    return to_toml({**tree, "joints": tree["joints"] or None})


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
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise UserError(f"{path}: is not TOML: {error}") from error
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _vehicle(content: Mapping[str, object]) -> Vehicle:
    version = content.get("version")
    if version not in (1, 2):
        raise ValueError(f"version {version!r}: this groma reads versions 1 and 2")
    tree = content if version == 2 else _of_version_1(content)
    _known(tree, _KEYS, "key")
    drive = _table(tree.get("drive"), "[drive]")
    model, unit = _model(drive), _unit(tree)
    joints = _joints(tree, model)
    first, *others = _scanners(tree.get("scanners"))
    values = {name: value for name, value in drive.items() if name != "model"}
    common = {"laser_x": first.x, "laser_y": first.y, "laser_yaw": first.yaw, "delay": tree.get("delay", 0.0)}
    own = [name for name in PARAMETERS[model] if name not in COMMON]
    _known(values, set(own), f"parameter of a {model}")
    parameters = _numbers({name: values.get(name, _OPTIONAL.get(name)) for name in own} | common)
    names, covariance = _covariance(tree.get("covariance"), PARAMETERS[model])
    noise = _noise(tree.get("noise"))
    return Vehicle(
        model,
        parameters,
        names,
        covariance,
        unit,
        joints,
        noise,
        first.name,
        first.range_offset,
        tuple(others),
    )


def _of_version_1(content: Mapping[str, object]) -> dict[str, object]:
    """Return the tree of version 2 of one of version 1."""
    _known(content, _KEYS_1, "key")
    model = _model(content)
    _unit(content)
    _joints(content, model)
    values = dict(_table(content.get("parameters"), "[parameters]"))
    _known(values, set(PARAMETERS[model]), f"parameter of a {model}")
    numbers = _numbers({name: values.get(name, _OPTIONAL.get(name)) for name in PARAMETERS[model]})
    scanner = {key: numbers[f"laser_{key}"] for key in ("x", "y", "yaw")}
    tree = {key: content[key] for key in ("unit", "joints", "covariance") if key in content}
    drive = {name: value for name, value in numbers.items() if name not in COMMON}
    return {**tree, "delay": numbers["delay"], "drive": {"model": model, **drive}, "scanners": [scanner]}


def _table(table: object, name: str) -> Mapping[str, object]:
    if not isinstance(table, Mapping):
        raise ValueError(f"there is no table {name}")
    return table


def _known(table: Mapping[str, object], known: set[str], what: str) -> None:
    if unknown := sorted(set(table) - known):
        raise ValueError(f"unknown {what} {unknown[0]}: there are {', '.join(sorted(known))}")


def _model(table: Mapping[str, object]) -> Model:
    model = table.get("model")
    if not isinstance(model, str) or model not in PARAMETERS:
        raise ValueError(f"model {model!r}: there are {', '.join(PARAMETERS)}")
    return cast(Model, model)


def _unit(tree: Mapping[str, object]) -> Unit:
    unit = tree.get("unit", "rad")
    if unit == "rad" or unit == "tick":
        return unit
    raise ValueError(f"unit {unit!r}: is rad or tick")


def _joints(content: Mapping[str, object], model: str) -> tuple[str, ...]:
    joints = content.get("joints", [])
    if not isinstance(joints, list) or not all(isinstance(name, str) for name in joints):
        raise ValueError("joints: is a list of names")
    if joints and len(joints) != len(JOINTS[model]):
        raise ValueError(f"joints: a {model} has {len(JOINTS[model])}, {' and '.join(JOINTS[model])}")
    return tuple(joints)


def _numbers(values: Mapping[str, object]) -> dict[str, float]:
    for name, value in values.items():
        if value is None:
            raise ValueError(f"the parameter {name} is missing")
        if not _is_number(value):
            raise ValueError(f"the parameter {name} is {value!r}, not a finite number")
    return {name: float(cast(float, value)) for name, value in values.items()}


def _noise(table: object) -> WheelNoise:
    usual = asdict(usual_noise())
    if table is None:
        return WheelNoise(**usual)
    values = _table(table, "[noise]")
    _known(values, set(usual), "key of [noise]")
    return WheelNoise(**_numbers({**usual, **values}))


def _scanners(tables: object) -> list[Scanner]:
    if not isinstance(tables, list) or not tables:
        raise ValueError("there is no table [[scanners]]")
    return [_scanner(_table(table, "[[scanners]]")) for table in tables]


def _scanner(table: Mapping[str, object]) -> Scanner:
    _known(table, {"name", "x", "y", "yaw", "range_offset"}, "key of [[scanners]]")
    name = table.get("name", "")
    if not isinstance(name, str):
        raise ValueError("[[scanners]] name: is a text")
    numbers = _numbers(
        {key: table.get(key) for key in ("x", "y", "yaw")} | {"range_offset": table.get("range_offset", 0.0)}
    )
    return Scanner(name, numbers["x"], numbers["y"], numbers["yaw"], numbers["range_offset"])


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
    return tuple(names), np.array(rows, dtype=np.float64).reshape(size, size)


def _is_row(row: object, size: int) -> bool:
    return isinstance(row, list) and len(row) == size and all(map(_is_number, row))


def _is_number(value: object) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) < sys.float_info.max and math.isfinite(value)

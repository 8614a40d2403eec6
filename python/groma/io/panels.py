"""Our own file of a target: several flat panels, rigid on a robot, at any angles, in TOML.

    [[panel]]
    name = "front"
    type = "aprilgrid"           # aprilgrid, chessboard or charuco
    columns = 6                  # tags in a row (inner corners of a chessboard, squares of a ChArUco board)
    rows = 6
    size = 0.088                 # [m]; a board has square, and marker
    spacing = 0.3                # gap between tags as a share of their size
    first_id = 0                 # lower left tag; panels must not share tags
    xyz = [0.35, 0.0, 0.60]      # origin of the panel's frame seen from the robot [m]
    rpy = [1.5708, 0.0, 1.5708]  # its rotation, as in URDF: about x, then y, then z of the robot [rad]

What is left out has the default of :mod:`groma.nouns.target`; xyz and rpy are zero, which serves to calibrate a camera
but not to map a network. The rpy above lets the panel look ahead (its z is the robot's x, its y the robot's z); add the
heading to the last angle for another direction.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

import msgspec

from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.table import read_bytes
from groma.io.toml import to_toml
from groma.nouns.poses import quaternion_of_rpy, rpy_of
from groma.nouns.target import Panel, Pattern, Target


class _Place(msgspec.Struct):
    name: str
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)


def read_panels(path: Path) -> Target:
    """Read a target.

    Raises
    ------
    UserError
        When the file cannot be read, a key is unknown or of the wrong type, or the target makes no sense.
    """
    try:
        content = tomllib.loads(read_bytes(path).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path}: is not TOML: {error}") from error
    tables = content.get("panel")
    if not isinstance(tables, list) or set(content) != {"panel"}:
        raise UserError(f"{path}: a target has tables [[panel]] and nothing else")
    try:
        return Target(tuple(_panel(table, f"panel[{k}]") for k, table in enumerate(tables)))
    except (ValueError, msgspec.ValidationError) as error:
        raise UserError(f"{path}: {error}") from error


def write_panels(path: Path, target: Target) -> None:
    """Write a target; what is read from it again is the same target, up to rounding of the angles."""
    write_text(path, "\n".join("[[panel]]\n" + to_toml(_table(panel)) for panel in target.panels))


def _panel(table: object, path: str) -> Panel:
    if not isinstance(table, dict):
        raise ValueError(f"{path} is no table")
    try:
        place = msgspec.convert(table, _Place)
        pattern = msgspec.convert({k: v for k, v in table.items() if k not in ("name", "xyz", "rpy")}, Pattern)
    except msgspec.ValidationError as error:
        raise ValueError(f"{path}: {error}") from error
    return Panel(place.name, pattern, place.xyz, quaternion_of_rpy(*place.rpy))


def _table(panel: Panel) -> Mapping[str, object]:
    pattern: dict[str, object] = msgspec.to_builtins(panel.pattern)
    return {"name": panel.name, **pattern, "xyz": list(panel.position), "rpy": list(rpy_of(panel.quaternion))}

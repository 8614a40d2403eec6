"""Targets of Kalibr: one flat panel as yaml.

aprilgrid      tagCols, tagRows, tagSize [m], tagSpacing (gap as a share of the size); codeOffset, the first tag
checkerboard   targetCols, targetRows (inner corners), colSpacingMeters, rowSpacingMeters (must be equal here)

Tags are tag36h11 with a border of two modules, as kalibr_create_target_pdf prints them. Kalibr's circlegrid is refused.
Source: github.com/ethz-asl/kalibr/wiki/calibration-targets.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from groma.errors import UserError
from groma.io.yaml_file import converted, read_yaml
from groma.nouns.target import Chessboard, Panel, Pattern, TagGrid, Target

PANEL = "panel"
"""Name that the panel gets."""


class _AprilGrid(msgspec.Struct, rename="camel"):
    tag_cols: int
    tag_rows: int
    tag_size: float
    tag_spacing: float
    code_offset: int = 0


class _Checkerboard(msgspec.Struct, rename="camel"):
    target_cols: int
    target_rows: int
    col_spacing_meters: float
    row_spacing_meters: float


def read_kalibr_target(path: Path) -> Target:
    """Read a target.

    Raises
    ------
    UserError
        When the file cannot be read, is of another kind, or makes no sense.
    """
    values = read_yaml(path)
    kind = values.get("target_type") if isinstance(values, dict) else None
    if kind not in ("aprilgrid", "checkerboard"):
        raise UserError(f"{path}: target_type is {kind!r}: must be aprilgrid or checkerboard")
    pattern = _grid(path, values) if kind == "aprilgrid" else _board(path, values)
    try:
        return Target((Panel(PANEL, pattern),))
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _grid(path: Path, values: object) -> Pattern:
    grid = converted(path, values, _AprilGrid, "a Kalibr aprilgrid")
    return TagGrid(grid.tag_cols, grid.tag_rows, grid.tag_size, grid.tag_spacing, first_id=grid.code_offset)


def _board(path: Path, values: object) -> Pattern:
    board = converted(path, values, _Checkerboard, "a Kalibr checkerboard")
    if board.col_spacing_meters != board.row_spacing_meters:
        raise UserError(f"{path}: colSpacingMeters and rowSpacingMeters differ: squares must be square")
    return Chessboard(board.target_cols, board.target_rows, board.col_spacing_meters)

"""Occupancy maps as nav2 and ROS 1 keep them: a yaml file and a grey image beside it.

Row 0 of the image is the top, row 0 of the grid the bottom; `origin` is the lower-left corner of the lower-left cell.
With grey v in 0..255 the occupancy is p = 1 - v/255 (v/255 when `negate`), and a cell is by `mode`

    trinary   100 when p >= occupied_thresh, 0 when p <= free_thresh, else -1
    scale     the same, in between round(100 (p - free_thresh) / (occupied_thresh - free_thresh))
    raw       v, -1 when v > 100

Transparent pixels are unknown in trinary and scale. Source: navigation2, nav2_map_server/src/map_io.cpp.

Written are 0 occupied, 254 free, 205 unknown with the thresholds 0.65 and 0.196: 205 means p = 0.19608, which a
free_thresh of 0.25 would turn into free. Resolution and origin keep all their digits; the saver of nav2 rounds them to
three, which scales a map of 0.0125 m cells by 4 %. Maps with a turned origin are refused: most readers ignore the turn.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from groma.errors import UserError
from groma.io.atomic import write_bytes, write_text
from groma.io.yaml_file import converted, read_yaml
from groma.nouns.bounds import in_file
from groma.nouns.maps import OccupancyGrid

Grey = NDArray[np.uint8]
Cells = NDArray[np.int8]

OCCUPIED, FREE, UNKNOWN = 0, 254, 205


class _Header(msgspec.Struct):
    """The yaml file."""

    image: Annotated[str, msgspec.Meta(min_length=1)]
    resolution: Annotated[float, msgspec.Meta(gt=0)]
    origin: tuple[float, float, float]
    negate: bool | Literal[0, 1]
    occupied_thresh: float
    free_thresh: float
    mode: Literal["trinary", "scale", "raw"] = "trinary"


def write_map(path: Path, grid: OccupancyGrid) -> None:
    """Write `path` (yaml) and the image of the same name (.pgm) beside it.

    Cells below 0 become unknown, those from 65 occupied, all others free.
    """
    image = path.with_suffix(".pgm")
    height, width = grid.cells.shape
    write_bytes(image, b"P5\n%d %d\n255\n" % (width, height) + to_grey(grid.cells)[::-1].tobytes())
    x, y = grid.origin
    text = (
        f"image: {image.name}\nmode: trinary\nresolution: {_digits(grid.resolution)}\n"
        f"origin: [{_digits(x)}, {_digits(y)}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    write_text(path, text)


def to_grey(cells: Cells) -> Grey:
    """Return the pixels (H, W) of cells (H, W), in the same order of rows."""
    return np.select([cells < 0, cells >= 65], [UNKNOWN, OCCUPIED], FREE).astype(np.uint8)


def read_map(path: Path) -> OccupancyGrid:
    """Read a map from its yaml file.

    Raises
    ------
    UserError
        When a file is missing or malformed, naming the key, or the origin is turned.
    """
    header = _read_header(path)
    x, y, yaw = header.origin
    if not (math.isfinite(yaw) and abs(math.remainder(yaw, 2 * math.pi)) <= 1e-9):
        raise UserError(f"{path}: the origin is turned by {yaw} rad: rotate the image and write 0")
    grey, opaque = _read_image(path.parent / header.image)
    with in_file(path):
        return OccupancyGrid(header.resolution, (x, y), _to_cells(header, grey, opaque)[::-1].copy())


def _digits(value: float) -> str:
    """Return the shortest decimal that reads back as the same number, never as 1e-05, which old yaml takes for text."""
    return np.format_float_positional(value, trim="0")


def _read_header(path: Path) -> _Header:
    header = converted(path, read_yaml(path), _Header, "a map")
    if not 0 <= header.free_thresh < header.occupied_thresh <= 1:
        raise UserError(f"{path}: free_thresh must be below occupied_thresh, both from 0 to 1")
    return header


def _read_image(path: Path) -> tuple[Grey, NDArray[np.bool_]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # maps of buildings are large
            with Image.open(path) as image:
                if image.mode.startswith("I") or image.mode == "F":
                    raise UserError(f"{path}: more than 8 bits a pixel: convert it to 8-bit grey")
                alpha = np.asarray(image.convert("LA"))
    except (UnidentifiedImageError, Image.DecompressionBombError, SyntaxError, ValueError) as error:
        raise UserError(f"{path}: not an image that can be read: {error}") from error
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror or error})") from error
    return alpha[..., 0], alpha[..., 1] == 255


def _to_cells(header: _Header, grey: Grey, opaque: NDArray[np.bool_]) -> Cells:
    if header.mode == "raw":
        return np.where(grey > 100, -1, grey).astype(np.int8)
    p = grey / 255 if header.negate else 1 - grey / 255
    low, high = header.free_thresh, header.occupied_thresh
    between = np.rint(100 * (p - low) / (high - low)) if header.mode == "scale" else np.full(p.shape, -1.0)
    cells = np.select([~opaque, p >= high, p <= low], [-1, 100, 0], between)
    return cells.astype(np.int8)

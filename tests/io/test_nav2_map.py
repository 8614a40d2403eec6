from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from groma.errors import UserError
from groma.io.nav2_map import read_map, write_map
from groma.nouns.maps import OccupancyGrid

CELLS = np.array([[-1, 0, 100, 0], [100, 100, -1, 0], [0, 0, 0, -1]], dtype=np.int8)


@pytest.mark.parametrize(
    ("resolution", "origin"),
    [(0.0125, (-12.345678901234, 1 / 3)), (0.05, (1e-5, -3.5527e-15)), (1.0, (0.0, 9.8765e6))],
)
def test_round_trip_is_exact(tmp_path: Path, resolution: float, origin: tuple[float, float]) -> None:
    path = tmp_path / "map.yaml"
    write_map(path, OccupancyGrid(resolution, origin, CELLS))
    read = read_map(path)
    assert (read.resolution, read.origin) == (resolution, origin)
    np.testing.assert_array_equal(read.cells, CELLS)


def test_bytes_are_those_that_nav2_expects(tmp_path: Path) -> None:
    write_map(tmp_path / "hall.yaml", OccupancyGrid(0.0125, (-1.5, 1e-5), CELLS))
    assert (tmp_path / "hall.yaml").read_text() == (
        "image: hall.pgm\nmode: trinary\nresolution: 0.0125\norigin: [-1.5, 0.00001, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    top_first = bytes([254, 254, 254, 205, 0, 0, 205, 254, 205, 254, 0, 254])
    assert (tmp_path / "hall.pgm").read_bytes() == b"P5\n4 3\n255\n" + top_first


def _write(directory: Path, pixels: Image.Image, **keys: object) -> Path:
    pixels.save(directory / "m.png")
    values = {"image": "m.png", "resolution": 0.1, "origin": "[0, 0, 0]", "negate": 0} | keys
    values = {"occupied_thresh": 0.65, "free_thresh": 0.196} | values
    path = directory / "m.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in values.items() if value is not None))
    return path


def _read_row(directory: Path, row: list[int], **keys: object) -> list[int]:
    pixels = Image.fromarray(np.array([row], dtype=np.uint8))
    cells: list[int] = read_map(_write(directory, pixels, **keys)).cells[0].tolist()
    return cells


def test_modes(tmp_path: Path) -> None:
    row = [0, 89, 90, 150, 204, 205, 206, 255]
    assert _read_row(tmp_path, row) == [100, 100, -1, -1, -1, -1, 0, 0]
    assert _read_row(tmp_path, row, mode="scale") == [100, 100, 99, 48, 1, 0, 0, 0]
    assert _read_row(tmp_path, [0, 1, 99, 100, 101, 255], mode="raw") == [0, 1, 99, 100, -1, -1]
    for negate in (1, "true", "True"):
        assert _read_row(tmp_path, [255, 166, 165, 50, 49, 0], negate=negate) == [100, 100, -1, -1, 0, 0]


def test_thresholds_include_their_value(tmp_path: Path) -> None:
    assert _read_row(tmp_path, [0, 255], occupied_thresh=1, free_thresh=0) == [100, 0]


def test_transparent_pixels_are_unknown(tmp_path: Path) -> None:
    pixels = Image.fromarray(np.array([[[0, 0, 0, 255], [0, 0, 0, 254], [255, 255, 255, 255]]], dtype=np.uint8))
    for mode in ("trinary", "scale"):
        assert read_map(_write(tmp_path, pixels, mode=mode)).cells.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"resolution": None}, "missing required field `resolution`"),
        ({"negate": None}, "missing required field `negate`"),
        ({"free_thresh": None}, "missing required field `free_thresh`"),
        ({"resolution": 0}, r"> 0.* at `\$.resolution`"),
        ({"resolution": ".nan"}, "> 0|finite"),
        ({"resolution": "wide"}, r"at `\$.resolution`"),
        ({"origin": "[0, 0]"}, r"at `\$.origin`"),
        ({"origin": "[0, 0, 0.3]"}, "turned by 0.3 rad"),
        ({"mode": "best"}, r"at `\$.mode`"),
        ({"free_thresh": 0.7}, "free_thresh must be below"),
        ({"image": "none.png"}, "none.png: cannot be read"),
        ({"image": "m.yaml"}, "not an image"),
        ({"image": "[unclosed"}, "not a yaml file"),
        ({"image": "!!python/object/apply:os.system [ls]"}, "m.yaml: not a"),
    ],
)
def test_names_the_fault(tmp_path: Path, keys: dict[str, object], message: str) -> None:
    path = _write(tmp_path, Image.new("L", (2, 2)), **keys)
    with pytest.raises(UserError, match=message) as caught:
        read_map(path)
    assert "\n" not in str(caught.value)


def test_refuses_16_bit(tmp_path: Path) -> None:
    path = _write(tmp_path, Image.fromarray(np.zeros((2, 2), dtype=np.uint16)))
    with pytest.raises(UserError, match="8 bits"):
        read_map(path)


def test_a_cut_image_is_named(tmp_path: Path) -> None:
    write_map(tmp_path / "map.yaml", OccupancyGrid(0.05, (0.0, 0.0), CELLS))
    image = tmp_path / "map.pgm"
    image.write_bytes(image.read_bytes()[:-3])
    with pytest.raises(UserError, match=r"map\.pgm"):
        read_map(tmp_path / "map.yaml")

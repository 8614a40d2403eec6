"""Print what finding corners and calibrating cameras reach on images of others (../shared/data/camera).

.venv/bin/python benches/cameras.py ../shared/data/camera
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

from groma.cameras.calibration import calibrate_camera
from groma.cameras.vision import detect, detect_tags
from groma.io.images import read_images
from groma.io.notes import Notes
from groma.nouns.detection import Detection
from groma.nouns.target import Charuco, Chessboard, Panel, Pattern, TagGrid, Target

GRIDS = {"iphone": 36, "two_boards": 36}
"""Frames whose grid is wider than six tags."""
REPEATS = 3


def main(directory: Path) -> None:
    """Print all figures."""
    for path in sorted((directory / "kalibr_aprilgrid_frames").glob("*.png")):
        _frame(path)
    left = Target((Panel("board", Chessboard(9, 6, 0.025)),))
    charuco = Target((Panel("board", Charuco(5, 7, 0.036195, 0.018256)),))
    corners = directory / "derived_corners"
    for rejection in (1e6, 5.2):
        seen = _given(corners / "opencv_left_chessboard.csv")
        _calibrated("left, corners of OpenCV", (640, 480), left, seen, {"lens": "plumb_bob", "rejection": rejection})
        seen = _given(corners / "robot_static_camera_charuco.csv")
        _calibrated("charuco, corners of OpenCV", (1600, 1200), charuco, seen, {"rejection": rejection})
    _calibrated("left, own corners", (640, 480), left, _found(directory / "opencv_left_chessboard", left), {})
    images = directory / "robot_static_camera_charuco" / "images"
    _calibrated("charuco, own corners", (1600, 1200), charuco, _found(images, charuco), {})


def _frame(path: Path) -> None:
    (image,) = read_images(path, Notes())
    columns = GRIDS.get(path.stem, 6)
    pattern: Pattern = TagGrid(columns, 6 if columns == 6 else 12, 0.088)
    target = Target((Panel("board", pattern),))
    whole = min(_timed(lambda: detect(image.pixels, target)) for _ in range(REPEATS))
    alone = min(_timed(lambda: detect_tags(image.pixels, border=2)) for _ in range(REPEATS))
    tags = sum(len(np.unique(seen.corners // 4)) for seen in detect(image.pixels, target)[0])
    height, width = image.pixels.shape
    print(f"{path.stem}: {width} x {height}, {tags} tags, {1e3 * whole:.0f} ms, detector alone {1e3 * alone:.0f} ms")


def _timed(work: object) -> float:
    assert callable(work)  # noqa: S101
    start = perf_counter()
    work()
    return perf_counter() - start


def _given(path: Path) -> list[Detection]:
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    seen = []
    for k, image in enumerate(np.unique(table["image"])):
        rows = table[table["image"] == image]
        pixels = np.column_stack([rows["u_px"], rows["v_px"]])
        sigma = np.full(len(rows), 0.3)
        seen.append(Detection(float(k), "camera", "board", rows["corner"].astype(np.int64), pixels, sigma))
    return seen


def _found(folder: Path, target: Target) -> list[Detection]:
    images = read_images(folder, Notes())
    return [seen for k, image in enumerate(images) for seen in detect(image.pixels, target, stamp=float(k))[0]]


def _calibrated(
    name: str, size: tuple[int, int], target: Target, seen: list[Detection], settings: dict[str, object]
) -> None:
    start = perf_counter()
    found = calibrate_camera(size, target, seen, {"splits": 40, **settings})
    taken = perf_counter() - start
    sigmas = np.sqrt(np.diag(found.claimed))
    shown = ", ".join(
        f"{n} {p:.2f} +- {s:.2f}"
        for n, p, s in zip(found.camera.names[:4], found.camera.parameters, sigmas, strict=False)
    )
    honest = found.honesty
    print(
        f"{name} {settings}: {shown}; rms {found.rms:.4f} ({found.rms_all:.4f} of all), halves {honest.factor:.2f}, "
        f"z of fx {honest.z_rms[0]:.2f}, halves {honest.projection_rms:.1f} px, {taken:.1f} s"
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))

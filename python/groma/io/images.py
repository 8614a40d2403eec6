"""Grey images from a folder or a video, one after the other, with what could not be read.

A folder is read in the natural order of its names (2 before 10). Of a video so many frames are taken, evenly, as
:data:`MOST_FRAMES` allows; it needs OpenCV. All images must have one size: a camera has one.
"""

from __future__ import annotations

import hashlib
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from groma.errors import UserError
from groma.io.notes import Notes
from groma.io.opencv import load_opencv
from groma.nouns.arrays import Gray

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp"})
VIDEOS = frozenset({".mp4", ".avi", ".mkv", ".mov", ".m4v", ".webm", ".mjpg"})
MOST_FRAMES = 300


@dataclass(frozen=True, slots=True)
class NamedImage:
    """An image."""

    name: str
    pixels: Gray
    """(height, width)."""

    @property
    def key(self) -> str:
        """A hash of the size and the grey values."""
        head = f"{self.pixels.shape}".encode()
        return hashlib.sha256(head + self.pixels.tobytes()).hexdigest()


def read_images(path: Path, notes: Notes) -> Iterator[NamedImage]:
    """Yield the images of a folder, a video, or a single file.

    Raises
    ------
    UserError
        When there is none, or they differ in size.
    """
    first: NamedImage | None = None
    for image in _video(path) if path.suffix.lower() in VIDEOS else _files(path, notes):
        if first is not None and image.pixels.shape != first.pixels.shape:
            raise UserError(
                f"{path}: {first.name} is {_size(first)} and {image.name} is {_size(image)}: "
                "a camera has one size of image; sort them into folders"
            )
        first = first or image
        yield image
    if first is None:
        raise UserError(f"{path}: no image in it that can be read")


def count_images(path: Path) -> int | None:
    """Return how many images there will be, at most; None when it is unknown before."""
    return None if path.suffix.lower() in VIDEOS else len(_names(path))


def _size(image: NamedImage) -> str:
    height, width = image.pixels.shape
    return f"{width} x {height}"


def _names(path: Path) -> list[Path]:
    if path.is_dir():
        files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file()]
        return sorted(files, key=lambda file: [int(t) if t.isdigit() else t for t in re.split(r"(\d+)", file.name)])
    if not path.exists():
        raise UserError(f"{path}: there is no such folder or file")
    if path.suffix.lower() not in SUFFIXES:
        raise UserError(f"{path}: is no folder with images and no video ({', '.join(sorted(VIDEOS))})")
    return [path]


def _files(path: Path, notes: Notes) -> Iterator[NamedImage]:
    files = _names(path)
    if not files:
        raise UserError(f"{path}: no image in it ({', '.join(sorted(SUFFIXES))})")
    for file in files:
        pixels = _read(file)
        if pixels is None:
            notes.reject(file.name, "cannot be read as an image")
        else:
            yield NamedImage(file.name, pixels)


def _read(file: Path) -> Gray | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(file) as image:
                return _deep(image) if image.mode.startswith("I") else np.asarray(image.convert("L"))
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, SyntaxError, ValueError):
        return None


def _deep(image: Image.Image) -> Gray:
    """Return an image of more than 8 bits by its upper 8 that are used."""
    values = np.asarray(image).astype(np.int64)
    shift = max(0, int(values.max(initial=0)).bit_length() - 8)
    return (np.clip(values, 0, None) >> shift).astype(np.uint8)


def _video(path: Path) -> Iterator[NamedImage]:
    cv2 = load_opencv(f"{path} is a video")
    if not path.is_file():
        raise UserError(f"{path}: there is no such file")
    capture = cv2.VideoCapture(str(path))
    try:
        step = max(1, -(-int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) // MOST_FRAMES))
        for frame in range(2**62):
            if not capture.grab():
                return
            if frame % step == 0:
                _, colours = capture.retrieve()
                grey: Gray = colours if colours.ndim == 2 else cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY)
                yield NamedImage(f"frame {frame}", grey)
    finally:
        capture.release()

"""Where a camera node takes its images from: a folder, a video file, a V4L2 device. Grey images, one at a time.

A folder gives its images in the order of their names, each once; a video its frames. A device gives the newest image
at the time it is asked: older ones that wait in the driver are thrown away. An image that cannot be read is told and
passed over.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from groma.errors import UserError

Grey = NDArray[np.uint8]
SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".tif", ".tiff"})
_BUFFERED = 4
"""Images that a driver may hold back."""


class Source(Protocol):
    """Images of one camera."""

    @property
    def name(self) -> str:
        """What it is, for a person."""
        ...

    def take(self) -> Grey | None:
        """Return the next image (h, w); None when there is none any more.

        Raises
        ------
        UnreadableError
            When this one cannot be read; the next may be asked for.
        """
        ...


class UnreadableError(Exception):
    """One image that cannot be read."""


def open_source(where: str) -> Source:
    """Open a folder of images, a video file, or a device (`/dev/video0`).

    Raises
    ------
    UserError
        When there is no such thing, or no image in the folder.
    """
    path = Path(where)
    if path.is_dir():
        return Folder(path)
    if path.is_file() or path.is_char_device():
        return Video(path)
    raise UserError(f"{where}: there is no such folder, video or device")


class Folder:
    """Images of a folder, in the order of their names."""

    def __init__(self, path: Path) -> None:
        images = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES)
        if not images:
            raise UserError(f"{path}: no image in it ({', '.join(sorted(SUFFIXES))})")
        self.name = f"folder {path.name}"
        self._images: Iterator[Path] = iter(images)

    def take(self) -> Grey | None:
        """Return the next image; see :class:`Source`."""
        path = next(self._images, None)
        if path is None:
            return None
        try:
            with Image.open(path) as image:
                return np.asarray(image.convert("L"))
        except (OSError, UnidentifiedImageError) as error:
            raise UnreadableError(f"{path.name}: cannot be read as an image") from error


class Video:
    """Frames of a video file, or what a device sees now."""

    def __init__(self, path: Path) -> None:
        self.name = f"{'device' if path.is_char_device() else 'video'} {path.name}"
        self._live = path.is_char_device()
        self._cv2 = _opencv()
        self._capture = self._cv2.VideoCapture(str(path))
        if not self._capture.isOpened():
            raise UserError(f"{path}: cannot be opened as a video")

    def take(self) -> Grey | None:
        """Return the next image; see :class:`Source`."""
        for _ in range(_BUFFERED if self._live else 0):
            self._capture.grab()
        read, image = self._capture.read()
        if not read:
            return None
        return np.asarray(image if image.ndim == 2 else self._cv2.cvtColor(image, self._cv2.COLOR_BGR2GRAY))


def _opencv() -> Any:
    try:
        import cv2
    except ModuleNotFoundError as error:
        raise UserError("videos and devices need OpenCV: pip install 'groma[vision]'") from error
    return cv2

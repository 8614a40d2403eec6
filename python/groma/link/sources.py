"""Where a camera node takes its images from: a folder, a video file, a V4L2 device. Grey images, one at a time.

A folder gives its images in the order of their names, each once; a video its frames. A device gives what it sees now:
images that wait in the driver are thrown away. Images that cannot be read are passed over and counted.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from groma.errors import UserError
from groma.io.images import count_images, read_images
from groma.io.notes import Notes
from groma.io.opencv import load_opencv

Grey = NDArray[np.uint8]
_BUFFERED = 4
"""Images that a driver may hold back."""


class Source(Protocol):
    """Images of one camera."""

    @property
    def name(self) -> str:
        """What it is, for a person."""
        ...

    @property
    def failures(self) -> int:
        """Images that could not be read."""
        ...

    def take(self) -> Grey | None:
        """Return the next image (h, w); None when there is none any more."""
        ...


def open_source(path: Path) -> Source:
    """Open a folder of images, a video file, or a device.

    Raises
    ------
    UserError
        When there is no such thing, or no image in the folder.
    """
    return Device(path) if path.is_char_device() else Files(path)


class Files:
    """Images of a folder in the order of their names, or the frames of a video."""

    def __init__(self, path: Path) -> None:
        if count_images(path) == 0:
            raise UserError(f"{path}: no image in it")
        self.name = f"images of {path.name}"
        self._notes = Notes()
        self._images = read_images(path, self._notes)

    @property
    def failures(self) -> int:
        """See :class:`Source`."""
        return self._notes.malformed

    def take(self) -> Grey | None:
        """Return the next image; see :class:`Source`."""
        image = next(self._images, None)
        return None if image is None else image.pixels


class Device:
    """What a V4L2 device sees now."""

    failures = 0

    def __init__(self, path: Path) -> None:
        self.name = f"device {path}"
        self._cv2 = load_opencv(f"{path} is a device")
        self._capture = self._cv2.VideoCapture(str(path))
        if not self._capture.isOpened():
            raise UserError(f"{path}: cannot be opened as a camera")

    def take(self) -> Grey | None:
        """Return the newest image; see :class:`Source`."""
        for _ in range(_BUFFERED):
            self._capture.grab()
        read, image = self._capture.read()
        if not read:
            return None
        return np.asarray(image if image.ndim == 2 else self._cv2.cvtColor(image, self._cv2.COLOR_BGR2GRAY))

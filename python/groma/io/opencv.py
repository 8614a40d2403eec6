"""OpenCV, imported only where a video or a board needs it."""

from __future__ import annotations

from types import ModuleType

from groma.errors import UserError


def load_opencv(why: str) -> ModuleType:
    """Return OpenCV.

    Raises
    ------
    UserError
        When it is not installed, with the line that installs it.
    """
    try:
        import cv2
    except ImportError as error:
        raise UserError(f"{why}, which needs OpenCV: pip install 'groma[vision]'") from error
    return cv2

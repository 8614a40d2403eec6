"""Calibrate, map and localize wheeled robots with a 2D laser scanner, accurately."""

from groma._core import __version__

__all__ = ["__version__"]

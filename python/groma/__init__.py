"""Make wheeled robots, and the cameras of the building they work in, accurate: calibrate, map, localize, plan."""

from groma._core import __version__

__all__ = ["__version__"]

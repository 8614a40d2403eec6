"""Map a building from a recording of a wheeled robot with a 2D laser scanner, accurately."""

from groma._core import __version__

__all__ = ["__version__"]

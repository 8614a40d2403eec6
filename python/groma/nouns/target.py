"""Targets: flat panels with numbered corners, held by hand or rigid on a robot.

Frames of the panels: a tag grid has x to the right, y up, z towards who looks at it, its origin at the lower left
corner of the first tag. Chessboard and ChArUco have x to the right, y down, z into the panel; the origin is the first
inner corner of a chessboard, the upper left corner of a ChArUco board. Corners of tag k of a grid are `4 k + 0..4`
(lower left, lower right, upper right, upper left), those of boards go by rows from the top.
"""

from __future__ import annotations

import msgspec

from groma import _core
from groma.nouns.arrays import Array


class TagGrid(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="aprilgrid"):
    """A grid of AprilTags, or one tag."""

    columns: int
    """Tags in a row."""
    rows: int
    size: float
    """Edge of the black square of a tag [m]."""
    spacing: float = 0.3
    """Gap between tags as a share of their size."""
    family: str = "tag36h11"
    first_id: int = 0
    """Number of the lower left tag."""
    border: int = 2
    """Width of the black border in modules: Kalibr prints 2, AprilTag itself 1."""


class Chessboard(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="chessboard"):
    """A plain chessboard."""

    columns: int
    """Inner corners in a row."""
    rows: int
    square: float
    """Edge of a square [m]."""


class Charuco(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="charuco"):
    """A chessboard with ArUco markers."""

    columns: int
    """Squares in a row."""
    rows: int
    square: float
    """Edge of a square [m]."""
    marker: float
    """Edge of a marker [m]."""
    dictionary: str = "DICT_6X6_250"
    first_id: int = 0
    """Number of the first marker."""
    legacy: bool = False
    """Whether OpenCV before 4.6 made it (it matters when the number of rows is even)."""


Pattern = TagGrid | Chessboard | Charuco


class Panel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A flat panel."""

    name: str
    pattern: Pattern
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Origin of the panel's frame seen from the robot [m]."""
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """Rotation of ``T_robot_panel``: x, y, z, w."""

    @property
    def corners(self) -> Array:
        """All corners (k, 3) in the frame of the panel [m], in the order of their numbers."""
        return _core.pattern_corners(msgspec.json.encode(self.pattern).decode())


class Target(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Panels that can be distinguished; a frozen value.

    Examples
    --------
    >>> target = Target((Panel("front", TagGrid(columns=6, rows=6, size=0.088)),))
    >>> target.panels[0].corners[5]
    array([0.2024, 0.    , 0.    ])
    """

    panels: tuple[Panel, ...]

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises
        ------
        ValueError
            When there is no panel, a size is out of range, or two panels look alike.
        """
        _core.target_check(self.json())

    def panel(self, name: str) -> Panel:
        """Return the panel of a name.

        Raises
        ------
        KeyError
            When there is none.
        """
        found = [panel for panel in self.panels if panel.name == name]
        if not found:
            raise KeyError(name)
        return found[0]

    def json(self) -> str:
        """Return it as the core takes it."""
        return msgspec.json.encode(self).decode()

"""A robot that is led live through a building whose cameras are to be mapped: told what it finds, it says where to go.

How it decides is that of :mod:`groma.planning.exploration`, whose settings it takes; the core (``crates/planning``)
does the work.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from groma import _core
from groma.errors import UserError
from groma.planning.exploration import Settings


class Place(msgspec.Struct, frozen=True):
    """A place as the robot finds it: a key to recognise it by, where it is [m], the directions of its exits [rad]."""

    key: int
    position: tuple[float, float]
    camera: bool
    exits: tuple[float, ...]


class Explorer:
    """A robot that is led live: told what it finds, it says by which exit to leave.

    Parameters
    ----------
    start
        The place where the robot stands; it defines the map.
    announced
        Number of cameras to find.
    settings
        How to explore.
    heading
        Of the robot at the start [rad].

    Raises
    ------
    UserError
        When a setting or the place is impossible.

    Examples
    --------
    >>> robot = Explorer(Place(0, (0.0, 0.0), True, (0.0,)), announced=2)
    >>> robot.next()
    0
    >>> robot.arrived(0, Place(1, (8.0, 0.0), True, (3.14159,)), enters=0)
    >>> robot.has_found_all
    True
    """

    def __init__(self, start: Place, announced: int, settings: Settings | None = None, heading: float = 0.0) -> None:
        chosen = _encoded((settings or Settings()).table())
        if announced < 1:
            raise UserError(f"announced = {announced}: must be at least 1")
        try:
            self._core = _core.ExplorerState(chosen, announced, _encoded(start), heading)
        except ValueError as error:
            raise UserError(str(error)) from error

    def next(self) -> int | None:
        """Return the exit by which to leave, None when nothing is left to do."""
        return self._core.next_exit()

    def arrived(self, left: int, place: Place, enters: int, via: Sequence[tuple[float, float]] | None = None) -> None:
        """Tell that the robot left by an exit and came to a place through one of its exits, with bends on the way [m].

        Without bends the way is assumed to be as it was before, straight if it is new.

        Raises
        ------
        UserError
            When that contradicts what was seen before; nothing is changed then.
        """
        self._observe({"arrived": {"left": left, "place": place, "enters": enters, "via": via}})

    def blocked(self, exit: int) -> None:  # noqa: A002 - the field's word
        """Tell that there was no getting through an exit, and that the robot is back.

        Raises
        ------
        UserError
            When the place has no such exit.
        """
        self._observe({"blocked": {"exit": exit}})

    @property
    def driven(self) -> float:
        """Distance so far [m]."""
        return self._core.driven()

    @property
    def sigma(self) -> float:
        """Root mean square standard deviation of the cameras found so far [m]."""
        return self._core.sigma()

    @property
    def has_found_all(self) -> bool:
        """Whether every announced camera was found."""
        return self._core.has_found_all()

    def _observe(self, event: object) -> None:
        try:
            self._core.observe(_encoded(event))
        except (ValueError, OverflowError) as error:
            raise UserError(str(error)) from error


def _encoded(value: object) -> str:
    return msgspec.json.encode(value).decode()

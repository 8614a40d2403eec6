"""Masks of free cells: shrunk by a clearance, thinned to middle lines, parts of them joined through narrow places.

Thinning takes away cells from the sides in turn until lines one cell wide are left that hang together as the mask did.
Source: Zhang and Suen, "A fast parallel algorithm for thinning digital patterns", CACM 27, 1984. Cells hang together by
any of their eight neighbours.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Cell = tuple[int, int]

AROUND = ((-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1))
"""Steps to the eight neighbours, in turn."""


def thinned(mask: Mask) -> Mask:
    """Return the middle lines of what is true, one cell wide."""
    mask = np.pad(mask, 1)
    changed = True
    while changed:
        changed = False
        for step in (0, 1):
            p = [_shifted(mask, d) for d in AROUND]
            count = np.sum(p, axis=0)
            turns = np.sum([~a & b for a, b in zip(p, [*p[1:], p[0]], strict=True)], axis=0)
            north, east, south, west = p[0], p[2], p[4], p[6]
            first = ~(north & east & south) & ~(east & south & west)
            second = ~(north & east & west) & ~(north & south & west)
            gone = mask & (count >= 2) & (count <= 6) & (turns == 1) & (second if step else first)
            if gone.any():
                mask &= ~gone
                changed = True
    return mask[1:-1, 1:-1]


def _shifted(values: NDArray[Any], by: Cell) -> NDArray[Any]:
    """Return for every cell what its neighbour has; outside it is zero."""
    padded = np.pad(values, 1)
    height, width = values.shape
    return padded[1 + by[0] : 1 + by[0] + height, 1 + by[1] : 1 + by[1] + width]


def shrunk(mask: Mask, cells: int) -> Mask:
    """Return what is further than so many cells from what is false, by steps to the four sides."""
    for _ in range(cells):
        mask = mask & np.all([_shifted(mask, d) for d in AROUND[::2]], axis=0)
    return mask


def joined(wide: Mask, narrow: Mask, least: float) -> Mask:
    """Return the wide mask with those middle lines of a narrower one that join parts of it.

    Parameters
    ----------
    wide, narrow
        The first lies within the second.
    least
        Least number of cells of a part that is joined.
    """
    room = np.zeros(wide.shape, np.intp)
    for number, part in enumerate(_parts(wide)):
        if len(part) >= least:
            room[tuple(np.array(part).T)] = number + 1
    around = [_shifted(room, d) for d in AROUND]
    whole = wide.copy()
    for line in _parts(thinned(narrow) & ~wide):
        cells = tuple(np.array(line).T)
        if len({int(n) for rooms in around for n in rooms[cells]} - {0}) > 1:
            whole[cells] = True
    return whole


def _parts(mask: Mask) -> Iterator[list[Cell]]:
    """Yield the cells of each part that hangs together."""
    left = {(int(r), int(c)) for r, c in np.argwhere(mask)}
    for row, column in np.argwhere(mask):
        start = (int(row), int(column))
        if start not in left:
            continue
        left.remove(start)
        part = [start]
        for r, c in part:
            near = {(r + d[0], c + d[1]) for d in AROUND} & left
            left -= near
            part += sorted(near)
        yield part

"""Put a folder in the place of another in one step: a reader sees the old one or the new one, never both in part.

Linux exchanges two names atomically (``renameat2`` with ``RENAME_EXCHANGE``, Linux 3.15, glibc 2.28). Where the system
or the file system cannot (NFS, some FUSE), a place is a link to a folder beside it, and the link is replaced
atomically instead. A folder that is no link cannot be replaced there; it is left as it is.
"""

from __future__ import annotations

import ctypes
import errno
import os
from pathlib import Path

from groma.errors import UserError

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
_UNSUPPORTED = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
_LINK, _PROBE = ".groma-link", (".groma-a", ".groma-b")


def install(made: Path, place: Path) -> Path | None:
    """Put a folder in a place beside it, and return where the one that was there is now; None when there was none.

    Parameters
    ----------
    made
        The new folder. It keeps its name where a link is needed.
    place
        In the same folder: free, an empty folder, a folder, or a link that an earlier call made.

    Raises
    ------
    UserError
        When a folder is there and cannot be exchanged.
    OSError
        When the system refuses; the place is untouched.
    """
    if place.is_symlink():
        old = place.parent / os.readlink(place)
        _point(made, place)
        return old
    if place.is_dir() and not any(place.iterdir()):
        place.rmdir()
    if not place.exists():
        if can_exchange(made):
            os.rename(made, place)
        else:
            _point(made, place)
        return None
    if not exchange(made, place):
        raise UserError(
            f"{place}: folders cannot be exchanged on this file system: remove it, or choose another with -o"
        )
    return made


def exchange(a: Path, b: Path) -> bool:
    """Exchange two names in one step; False where system or file system cannot.

    Raises
    ------
    OSError
        When the system refuses for another reason.
    """
    try:
        renameat2 = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        return False
    if renameat2(_AT_FDCWD, os.fsencode(a), _AT_FDCWD, os.fsencode(b), _RENAME_EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in _UNSUPPORTED:
        return False
    raise OSError(number, os.strerror(number), str(b))


def can_exchange(folder: Path) -> bool:
    """Whether names in a folder can be exchanged: tried with two empty ones."""
    a, b = (folder / name for name in _PROBE)
    try:
        a.mkdir()
        b.mkdir()
        return exchange(a, b)
    finally:
        for probe in (a, b):
            if probe.is_dir():
                probe.rmdir()


def _point(made: Path, place: Path) -> None:
    """Let a link stand in a place; it is made inside the new folder, so that nothing is left when this is cut short."""
    link = made / _LINK
    link.symlink_to(made.name, target_is_directory=True)
    os.replace(link, place)

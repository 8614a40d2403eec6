"""The folder of a run while it is made: beside its place, and in its place only when it is whole.

A run writes into ``.NAME.groma-xxxxxxxx`` beside NAME and holds a lock on it while it lives. Whatever ends the run
early leaves NAME as it was; what a killed run left is swept by the next one beside it, for nobody holds its lock any
more. Nothing is forced to the disk (no fsync): after a power cut the folder may be lost, after a crash of the program
not.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import tempfile
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from groma.errors import UserError
from groma.runs.exchange import install
from groma.runs.ownership import check_replaceable

try:
    import fcntl
except ImportError:  # Windows: nothing is locked, so nothing is swept
    fcntl = None  # type: ignore[assignment]

ROOT = Path("results")
_MADE = re.compile(r"\.(?P<name>.+)\.groma-[a-z0-9_]{8}")
_TAKEN = (errno.EEXIST, errno.ENOTEMPTY)


class Place:
    """Where a run's folder will be, and where it is made.

    Parameters
    ----------
    output
        The folder that the user requested; None: a new one in `results`, named by the time.

    Raises
    ------
    UserError
        When it is a file, holds what no run wrote, is in use as working folder or mount point, or cannot be written to.
    """

    def __init__(self, output: Path | None) -> None:
        self.shown = output if output is not None else ROOT / datetime.now().astimezone().strftime("%Y-%m-%dT%H-%M-%S")
        self.is_new = output is None
        """Whether the name is ours: then another is taken when it is not free, and nothing is replaced."""
        self._path = _resolved(self.shown)
        self._check()
        self._parents = [folder for folder in self._path.parents if not folder.exists()]
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            _sweep(self._path.parent)
            self.made, self._lock = _locked_folder(self._path)
        except OSError as error:
            self._remove_parents()
            reason = error.strerror or type(error).__name__
            raise UserError(f"{self.shown}: cannot be made ({reason}): choose another with -o") from error

    def install(self) -> Path:
        """Put the finished folder in its place and return that, as the user calls it.

        Raises
        ------
        UserError, OSError
            When it cannot be put there; the place is as it was.
        """
        if self.is_new:
            self._take_free_name()
        else:
            self._check()
            old = install(self.made, self._path)
            if old is not None:
                shutil.rmtree(old, ignore_errors=True)
        self._release()
        return self.shown

    def empty(self) -> None:
        """Remove all files that were made."""
        for entry in self.made.iterdir():
            if entry.is_dir() and not entry.is_symlink():
                shutil.rmtree(entry)
            else:
                entry.unlink()

    def abandon(self) -> None:
        """Remove what was made, and the folders above that were made for it."""
        shutil.rmtree(self.made, ignore_errors=True)
        self._release()
        self._remove_parents()

    def _check(self) -> None:
        path = self._path
        if path.is_file():
            raise UserError(f"{self.shown}: is a file, not a folder: choose another with -o")
        if path.is_mount() or path == Path.cwd() or path in Path.cwd().parents:
            raise UserError(
                f"{self.shown}: is in use and cannot be exchanged as a whole: choose a folder in it with -o"
            )
        if path.is_dir() and not self.is_new:
            try:
                check_replaceable(path)
            except UserError as error:
                raise UserError(str(error).replace(str(path), str(self.shown), 1)) from error

    def _take_free_name(self) -> None:
        first = self._path
        for number in range(1, 10_000):
            path = first if number == 1 else first.with_name(f"{first.name}-{number}")
            try:
                os.rename(self.made, path)
            except OSError as error:
                if error.errno not in _TAKEN:
                    raise
            else:
                self.shown, self._path = self.shown.with_name(path.name), path
                return

    def _release(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _remove_parents(self) -> None:
        with suppress(OSError):
            for folder in self._parents:
                folder.rmdir()


def check_place(output: Path | None) -> None:
    """Refuse a folder that a later run could not write, before the work that precedes it.

    Raises
    ------
    UserError
        As :class:`Place`.
    """
    Place(output).abandon()


def _resolved(path: Path) -> Path:
    """Return the absolute path; a link that stands in for a folder (see `exchange`) is not followed."""
    if path.is_symlink() and _MADE.fullmatch(os.readlink(path)):
        return path.parent.resolve() / path.name
    return path.resolve()


def _locked_folder(place: Path) -> tuple[Path, int | None]:
    """Make a folder beside a place that others know to be alive as long as its lock is held."""
    while True:
        made = Path(tempfile.mkdtemp(prefix=f".{place.name}.groma-", dir=place.parent))
        made.chmod(0o777 & ~_umask())
        if fcntl is None:
            return made, None
        handle = os.open(made, os.O_RDONLY)
        if _lock(handle) and _is_there(made, handle):
            return made, handle
        os.close(handle)


def _sweep(parent: Path) -> None:
    """Remove what killed runs left in a folder."""
    if fcntl is None:
        return
    for entry in parent.iterdir():
        found = _MADE.fullmatch(entry.name)
        if found and entry.is_dir() and not entry.is_symlink() and not _stands_for(parent / found["name"], entry):
            with suppress(OSError):
                _remove_if_dead(entry)


def _remove_if_dead(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        if _lock(handle):
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(handle)


def _stands_for(place: Path, folder: Path) -> bool:
    return place.is_symlink() and os.readlink(place) == folder.name


def _lock(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _is_there(folder: Path, handle: int) -> bool:
    """Whether nobody swept a folder before it was locked."""
    try:
        return os.path.samestat(os.stat(folder), os.fstat(handle))
    except FileNotFoundError:
        return False


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

from __future__ import annotations

import resource
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from groma.errors import UserError
from groma.io.atomic import write_bytes, write_text


@contextmanager
def _largest_file(size: int) -> Iterator[None]:
    """Make writing fail part of the way, as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "map.pgm"
    write_text(path, "old")
    with _largest_file(100_000), pytest.raises(UserError, match=r"map.pgm: cannot be written \(File too large\)"):
        write_bytes(path, bytes(1_000_000))
    assert [file.name for file in tmp_path.iterdir()] == ["map.pgm"]
    assert path.read_text() == "old"


def test_replaces_with_the_usual_permissions(tmp_path: Path) -> None:
    usual, path = tmp_path / "usual", tmp_path / "path"
    usual.write_text("")
    write_text(path, "old")
    write_text(path, "new\n")
    assert path.read_bytes() == b"new\n"
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(usual.stat().st_mode)


def test_a_missing_directory_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="No such file"):
        write_text(tmp_path / "none" / "file", "")

"""Links to the newest results: ``latest`` and, for every kind, ``latest-map``, ``latest-vehicle``, ... beside it."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from groma.io.atomic import write_text


def point_latest(folder: Path, kind: str) -> None:
    """Let `latest` and `latest-KIND` beside a folder point to it; where links need rights, files hold its name.

    Raises
    ------
    UserError
        When neither can be written.
    """
    for name in ("latest", f"latest-{kind}"):
        link, beside = folder.parent / name, folder.parent / f".{name}.new"
        try:
            beside.unlink(missing_ok=True)
            beside.symlink_to(folder.name, target_is_directory=True)
            with suppress(FileNotFoundError):  # another run has taken it, and pointed to a folder as new as this
                os.replace(beside, link)
        except OSError:
            write_text(folder.parent / f"{name}.txt", f"{folder.name}\n")

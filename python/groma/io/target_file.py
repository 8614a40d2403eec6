"""Read a target, whichever format it is in: TOML is ours, YAML Kalibr's."""

from __future__ import annotations

from pathlib import Path

from groma.errors import UserError
from groma.io.kalibr_target import read_kalibr_target
from groma.io.panels import read_panels
from groma.nouns.target import Target


def read_target(path: Path) -> Target:
    """Read a target.

    Raises
    ------
    UserError
        When the file cannot be read or makes no sense.
    """
    if path.suffix == ".toml":
        return read_panels(path)
    if path.suffix in (".yaml", ".yml"):
        return read_kalibr_target(path)
    raise UserError(f"{path}: a target is a .toml (panels of groma) or a .yaml (target of Kalibr)")

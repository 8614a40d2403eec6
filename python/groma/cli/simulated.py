"""What the verbs of `groma simulate` have in common: where a recording goes, and what draws it."""

from __future__ import annotations

from pathlib import Path

from groma.errors import UserError
from groma.runs.settings import Settings

_SUFFIXES = (".csv.gz", ".csv", ".mcap")


def recording_stem(output: Path) -> Path:
    """Return the name of a recording without its suffix, for what is written beside it.

    Raises
    ------
    UserError
        When the suffix is that of no format that is written.
    """
    for suffix in _SUFFIXES:
        if output.name.endswith(suffix) and output.name != suffix:
            return output.with_name(output.name.removesuffix(suffix))
    raise UserError(f"{output}: the name must end in one of {', '.join(_SUFFIXES)}")


def seed_of(settings: Settings) -> int:
    """Return the seed of a simulation.

    Raises
    ------
    UserError
        When there is none of this number.
    """
    seed = int(str(settings["seed"]))
    if seed < 0:
        raise UserError(f"--seed {seed}: must be at least 0")
    return seed

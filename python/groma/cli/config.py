"""`groma config`: the defaults of every setting, as TOML that can be edited and given back."""

from __future__ import annotations

from groma.io.toml import to_toml
from groma.runs.tables import tables


def config() -> None:
    """Print the settings of all commands with their defaults as TOML, a table a command: for --config."""
    print(to_toml({name: defaults() for name, defaults in tables().items()}), end="")

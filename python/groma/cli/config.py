"""`groma config`: the defaults of every setting, as TOML that can be edited and given back."""

from __future__ import annotations

from groma.io.toml import to_toml
from groma.mapper import map_defaults
from groma.network import network_defaults


def config() -> None:
    """Print the defaults of `groma map` and `groma cameras map` as TOML."""
    print(to_toml({"map": map_defaults(), "cameras": network_defaults()}), end="")

"""`groma config`: the defaults of every setting, as TOML that can be edited and given back."""

from __future__ import annotations

from groma.camera_calibration import camera_defaults
from groma.io.toml import to_toml
from groma.mapper import map_defaults
from groma.network import network_defaults
from groma.vision import detection_defaults


def config() -> None:
    """Print the defaults of `groma map`, `groma cameras map` and `groma calibrate camera` as TOML."""
    camera = {**camera_defaults(), "detection": detection_defaults()}
    print(to_toml({"map": map_defaults(), "cameras": network_defaults(), "camera": camera}), end="")

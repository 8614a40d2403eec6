from __future__ import annotations

import tomllib

import pytest

import groma.cli
from groma import _core


def test_prints_the_defaults_of_the_core_as_toml(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    defaults = {"resolution": 0.05, "scan": {"range_max": 30.0, "deskew": True}}
    monkeypatch.setattr(_core, "map_defaults", lambda: defaults, raising=False)
    assert groma.cli.run(["config"]) == 0
    printed = tomllib.loads(capsys.readouterr().out)
    assert printed["map"] == {"scans": "", "odometry": "", **defaults}
    assert printed["cameras"] == _core.network_defaults()

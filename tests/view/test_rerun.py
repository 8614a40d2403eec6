from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from groma.errors import UserError
from groma.nouns.maps import OccupancyGrid
from groma.view.rerun import load_rerun, occupied_centres, save_rrd
from ring_corridor import ring_corridor


def test_without_the_package_there_is_one_line_of_advice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UserError, match=r"pip install 'groma\[rerun\]'"):
        save_rrd(ring_corridor(10), tmp_path / "map.rrd")
    assert not list(tmp_path.iterdir())


def test_another_package_of_that_name_is_not_taken_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rerun", ModuleType("rerun"))
    with pytest.raises(UserError, match="another package is called rerun"):
        load_rerun()


def test_centres_of_occupied_cells() -> None:
    grid = OccupancyGrid(0.5, (10.0, 20.0), np.array([[0, 100], [-1, 0]], dtype=np.int8))
    assert occupied_centres(grid).tolist() == [[10.75, 20.25]]


def test_writes_a_recording(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    save_rrd(ring_corridor(50), tmp_path / "map.rrd")
    assert [path.name for path in tmp_path.iterdir()] == ["map.rrd"]
    assert (tmp_path / "map.rrd").read_bytes()[:4] == b"RRF2"

"""Landmarks that last join the map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import groma.cli
from groma.io.landmarks import read_landmarks, write_landmarks
from groma.mapping.promotion import promote
from groma.nouns.maps import Landmarks


def corners(points: list[tuple[float, float]], seen: int = 20, visible: int = 25) -> Landmarks:
    """Corners that open to the right, each known to 1 cm."""
    n = len(points)
    return Landmarks(
        kinds=np.full(n, "corner"),
        positions=np.array(points, dtype=np.float64).reshape(-1, 2),
        covariances=np.tile(np.eye(2) * 1e-4, (n, 1, 1)),
        orientations=np.zeros(n),
        descriptors=np.zeros((n, 16), dtype=np.uint8),
        seen=np.full(n, seen),
        visible=np.full(n, visible),
    )


def test_a_map_goes_through_the_core_and_comes_back() -> None:
    static = corners([(0, 0)])
    days = [corners([(0.01, 0), (5, 5)]), corners([(5.02, 5), (0, 0.02)])]
    days[0].descriptors[1, 3] = 9
    result = promote(static, days)
    assert (result.promoted, result.confirmed, result.findings) == (1, 1, ())
    new = result.landmarks
    assert new.positions == pytest.approx(np.array([[0, 0], [5.01, 5]]))
    assert (new.kinds.tolist(), new.seen.tolist(), new.visible.tolist()) == (["corner"] * 2, [20, 40], [25, 50])
    assert new.descriptors[1].tolist() == days[0].descriptors[1].tolist()


def test_a_map_of_elsewhere_is_told() -> None:
    day = corners([(0, 0)])
    assert [f.code for f in promote(corners([(50, 0)]), [day, day]).findings] == ["map-mismatch"]


def test_the_command_writes_the_new_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_landmarks(tmp_path / "map.json", corners([(0, 0)]))
    for day in ("monday", "tuesday"):
        (tmp_path / day).mkdir()
        write_landmarks(tmp_path / day / "landmarks.json", corners([(0, 0), (3, 3)]))
    drives = [str(tmp_path / day) for day in ("monday", "tuesday")]
    command = ["promote", str(tmp_path / "map.json"), *drives, "-o", str(tmp_path / "new")]
    assert groma.cli.run(command) == 0
    assert len(read_landmarks(tmp_path / "new" / "landmarks.json").positions) == 2
    assert "2 landmarks, 1 of them new; 1 of the old ones were seen again" in capsys.readouterr().out


def test_mistakes_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_landmarks(tmp_path / "map.json", corners([(0, 0)]))
    (tmp_path / "empty").mkdir()
    base = ["promote", str(tmp_path / "map.json")]
    out = ["-o", str(tmp_path / "new")]
    for arguments, told in (
        ([*base, str(tmp_path / "map.json"), *out], "drives = 1"),
        ([*base, str(tmp_path / "empty"), str(tmp_path / "empty"), *out], "is .*empty a folder of groma localize"),
        ([*base, *out, "--days", "1"], "days = 1: must be at least 2"),
    ):
        assert groma.cli.run(arguments) == 2
        assert pytest.importorskip("re").search(told, capsys.readouterr().err)
    assert not (tmp_path / "new").exists()

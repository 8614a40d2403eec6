"""Landmarks that last join the map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import groma.cli
from groma.io.landmarks import read_landmarks, write_landmarks
from groma.mapping import Landmarks
from groma.promotion import promote


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


def test_what_two_days_saw_joins_and_what_one_saw_does_not() -> None:
    static = corners([(0, 0)])
    days = [corners([(0.01, 0), (5, 5), (9, 9)]), corners([(5.01, 5), (0, 0.02)]), corners([(5.02, 5)])]
    result = promote(static, days)
    assert (result.promoted, result.confirmed) == (1, 1)
    assert result.landmarks.positions.tolist()[0] == [0, 0]
    assert result.landmarks.positions[1] == pytest.approx([5.01, 5])
    assert result.landmarks.covariances[1] == pytest.approx(np.eye(2) * 1e-4 / 3)
    assert (result.landmarks.seen[1], result.landmarks.visible[1]) == (60, 75)


def test_days_that_differ_widen_the_covariance() -> None:
    result = promote(corners([]), [corners([(0, 0)]), corners([(0.1, 0)])])
    # Each day is off by 5 sigma: chi-square 50 for two degrees of freedom.
    assert result.landmarks.covariances[0] == pytest.approx(np.eye(2) * 1e-4 / 2 * 25)


def test_what_is_rarely_detected_or_another_mark_does_not_join() -> None:
    rare = corners([(5, 5)], seen=5, visible=20)
    assert promote(corners([]), [rare, rare]).promoted == 0
    turned = corners([(5, 5)])
    turned.orientations[0] = np.pi
    assert promote(corners([]), [corners([(5, 5)]), turned]).promoted == 0


def test_the_command_writes_the_new_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_landmarks(tmp_path / "map.json", corners([(0, 0)]))
    for day in ("monday", "tuesday"):
        (tmp_path / day).mkdir()
        write_landmarks(tmp_path / day / "landmarks.json", corners([(0, 0), (3, 3)]))
    drives = [str(tmp_path / day) for day in ("monday", "tuesday")]
    command = ["promote", str(tmp_path / "map.json"), *drives, "-o", str(tmp_path / "new.json")]
    assert groma.cli.run(command) == 0
    assert len(read_landmarks(tmp_path / "new.json").positions) == 2
    assert "2 landmarks, 1 of them new; 1 of the old ones were seen again" in capsys.readouterr().out


def test_mistakes_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_landmarks(tmp_path / "map.json", corners([(0, 0)]))
    (tmp_path / "empty").mkdir()
    base = ["promote", str(tmp_path / "map.json")]
    out = ["-o", str(tmp_path / "new.json")]
    for arguments, told in (
        ([*base, str(tmp_path / "empty"), *out], "at least 2 are needed"),
        ([*base, str(tmp_path / "empty"), str(tmp_path / "empty"), *out], "is .*empty a folder of groma localize"),
        ([*base, *out, "--days", "1"], "--days 1"),
    ):
        assert groma.cli.run(arguments) == 2
        assert pytest.importorskip("re").search(told, capsys.readouterr().err)
    assert not (tmp_path / "new.json").exists()

"""Lists of surveyed reflectors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.chart import read_chart
from groma.io.reflector_list import SIGMA, read_reflectors, write_reflectors


def test_reads_with_and_without_a_head_and_a_sigma(tmp_path: Path) -> None:
    path = tmp_path / "list.csv"
    path.write_text("# survey of May\nx,y,sigma\n1.5, 2.25\n\n-3,4,0.01\n")
    marks = read_reflectors(path)
    assert marks.kinds.tolist() == ["reflector"] * 2
    assert marks.positions.tolist() == [[1.5, 2.25], [-3, 4]]
    assert marks.covariances[:, 0, 0] == pytest.approx([SIGMA**2, 1e-4])
    assert np.isnan(marks.orientations).all()
    assert read_chart(path).grid is None


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    points = np.array([[1.23456, -2.0], [0.0, 3.1]])
    write_reflectors(tmp_path / "list.csv", points)
    assert read_reflectors(tmp_path / "list.csv").positions == pytest.approx(points, abs=5e-5)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no reflector in it"),
        ("x,y\n", "no reflector in it"),
        ("1,2\n3\n", "list.csv:2"),
        ("1,2\n3,4,5,6\n", "list.csv:2"),
        ("1,2\nnan,4\n", "list.csv:2"),
        ("1,2,0\n", "list.csv:1: sigma"),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "list.csv"
    path.write_text(text)
    with pytest.raises(UserError, match=told):
        read_reflectors(path)


def test_a_map_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no landmarks.json in it"):
        read_chart(tmp_path)
    with pytest.raises(UserError, match="no map"):
        read_chart(tmp_path / "map.txt")

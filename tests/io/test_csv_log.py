from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made import read, text, texts

from groma.errors import UserError
from groma.io.recording import open_recording, write_recording
from groma.nouns.messages import BeamGeometry, JointState, LaserScan, Message, Odometry, Transform

NUMBER = st.floats(-1e7, 1e7)
STAMP = st.floats(0, 2e9)
NAME = st.text(
    st.characters(codec="utf-8", exclude_characters=",\r\n", exclude_categories=["Cc", "Zs", "Cs"]), min_size=1
)
STEP = st.floats(1e-6, 3.0) | st.floats(-3.0, -1e-6)
GEOMETRY = st.builds(BeamGeometry, st.floats(-10, 10), STEP, st.floats(-1, 1), st.floats(0, 1e3), st.floats(0, 1e4))


def arrays(n: int) -> st.SearchStrategy[Any]:
    return st.lists(st.floats(), min_size=n, max_size=n).map(np.array)


def positions(n: int) -> st.SearchStrategy[Any]:
    return st.lists(st.floats(-1e15, 1e15) | st.just(math.nan), min_size=n, max_size=n).map(np.array)


SCAN = st.integers(1, 5).flatmap(
    lambda n: st.builds(LaserScan, STAMP, NAME, NAME, GEOMETRY, arrays(n), st.one_of(arrays(n), arrays(0)))
)
JOINTS = st.integers(0, 3).flatmap(
    lambda n: st.builds(JointState, STAMP, NAME, st.tuples(*[NAME] * n), positions(n), positions(n))
)
POINT, TURN = st.tuples(*[NUMBER] * 3), st.tuples(*[NUMBER] * 4)
MESSAGE = st.one_of(
    SCAN,
    JOINTS,
    st.builds(Odometry, STAMP, NAME, NUMBER, NUMBER, NUMBER, NAME, NAME),
    st.builds(Transform, STAMP, NAME, NAME, NAME, POINT, TURN, st.booleans()),
)


def same(a: Message, b: Message) -> bool:
    def equal(x: Any, y: Any) -> bool:
        return bool(np.array_equal(x, y, equal_nan=True)) if isinstance(x, np.ndarray) else bool(x == y)

    return type(a) is type(b) and all(equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


@settings(deadline=None)
@given(st.lists(MESSAGE, min_size=1, max_size=8), st.sampled_from(["a.csv", "a.csv.gz"]))
def test_what_is_written_is_read_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, messages: list[Message], name: str
) -> None:
    path = tmp_path_factory.mktemp("csv") / name
    write_recording(path, messages)
    recording, back = read(path)
    assert texts(recording) == []
    assert len(back) == len(messages)
    assert all(same(a, b) for a, b in zip(messages, back, strict=True))


def test_the_same_messages_give_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.csv.gz", "b.csv.gz"):
        write_recording(tmp_path / name, [Odometry(1.0, "odom", 0.1, 0.2, 0.3)])
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()


GOOD = """\
GEOMETRY,/scan,-1.5,0.1,0,0.05,30
SCAN,1.0,/scan,laser,3,1.0,inf,nan
ODOM,1.5,/odom,odom,base_link,1,2,3
"""


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("SCAN,2.0,/scan,laser,4,1,2,3", "announces 4"),
        ("SCAN,2.0,/scan,laser,3,1,2,3,4", "1 fields after"),
        ("SCAN,2.0,/other,laser,1,1", "no GEOMETRY"),
        ("SCAN,x,/scan,laser,1,1", "stamp 'x' is not a number"),
        ("ODOM,1.5,/odom,odom,base_link,1,2", "7 fields, expected 8"),
        ("JOINTS,1.5,/j,2,a,1,2", "announces 2 joints"),
        ("TF,1", "fields"),
        ("GEOMETRY,/scan,1", "fields"),
    ],
)
def test_a_malformed_line_is_told_with_its_number(tmp_path: Path, line: str, told: str) -> None:
    recording, messages = read(text(tmp_path / "a.csv", GOOD + line + "\n"))
    assert len(messages) == 2
    assert recording.notes.examples[0].startswith("a.csv:4: ")
    assert told in recording.notes.examples[0]


def test_the_example_of_the_reference_page(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs/reference/csv.md").read_text()
    recording, messages = read(text(tmp_path / "a.csv", page.split("```")[1].lstrip()))
    assert [type(m) for m in messages] == [Transform, Odometry, LaserScan, JointState, JointState]
    assert texts(recording) == []


def test_other_tags_are_counted(tmp_path: Path) -> None:
    recording, _ = read(text(tmp_path / "a.csv", GOOD + "IMU,1,2,3\n# remark\n\n"))
    assert recording.notes.skipped == {"IMU": 1}


def test_a_name_with_a_comma_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="comma"):
        write_recording(tmp_path / "a.csv", [Odometry(1.0, "a,b", 0, 0, 0)])
    assert list(tmp_path.iterdir()) == []


def test_ticks_become_angles_and_overflow(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "ENCODER,w,steer,8192,8192\nENCODER,w,left,4096,65536\n"
        "TICKS,1,w,2,left,65530,steer,8190\nTICKS,2,w,2,left,10,steer,2\n"
        "ENCODER,w,right,nan,inf\nTICKS,3,w,1,right,7\nTICKS,4,w,2,right,7\nENCODER,w,x,0,1\nTICKS,5,w,1,right,x\n"
    )
    opened = open_recording(tmp_path / "a.csv")
    read = [m for m in opened.messages() if isinstance(m, JointState)]
    assert [stream.kind for stream in opened.streams] == ["joint state"]
    assert np.diff([m.positions for m in read[:2]], axis=0)[0] == pytest.approx(
        np.array([16 / 4096, 4 / 8192]) * 2 * np.pi
    )
    assert [m.unit for m in read] == ["rad", "rad", "tick"]
    assert read[2].positions.tolist() == [7.0]
    assert opened.notes.malformed == 3

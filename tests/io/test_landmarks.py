from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from groma.errors import UserError
from groma.io.landmarks import read_landmarks, write_landmarks
from groma.nouns.maps import Landmarks

_ROW = {"type": "corner", "position": [0, 0], "covariance": [[1, 0], [0, 1]], "seen": 1, "visible": 1}


def _landmarks(count: int) -> Landmarks:
    rng = np.random.default_rng(2)
    covariances = rng.normal(size=(count, 2, 2)) / 3e4
    kinds = rng.choice(["corner", "reflector"], count)
    corner = kinds == "corner"
    cells = rng.integers(1, 256, (count, 16), dtype=np.uint8) * (rng.random(count) < 0.7).astype(np.uint8)[:, None]
    return Landmarks(
        kinds=kinds,
        positions=rng.normal(size=(count, 2)),
        covariances=covariances,
        orientations=np.where(corner, rng.normal(size=count), np.nan),
        descriptors=cells,
        seen=rng.integers(1, 9, count),
        visible=np.full(count, 9),
    )


@pytest.mark.parametrize("count", [0, 1, 50])
def test_round_trip_is_exact(tmp_path: Path, count: int) -> None:
    path, landmarks = tmp_path / "landmarks.json", _landmarks(count)
    write_landmarks(path, landmarks)
    read = read_landmarks(path)
    for name in ("kinds", "positions", "covariances", "orientations", "descriptors", "seen", "visible"):
        np.testing.assert_array_equal(getattr(read, name), getattr(landmarks, name))


def test_is_plain_json_with_the_documented_keys(tmp_path: Path) -> None:
    path = tmp_path / "landmarks.json"
    write_landmarks(path, _landmarks(3))
    content = json.loads(path.read_text())
    assert {key: content[key] for key in ("version", "frame", "units")} == {
        "version": 1,
        "frame": "map",
        "units": {"length": "m", "angle": "rad"},
    }
    kept = {"type", "position", "covariance", "seen", "visible"}
    assert all(kept <= set(row) <= kept | {"orientation", "descriptor"} for row in content["landmarks"])
    assert len(path.read_text().splitlines()) == 3 + 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("version", 2), r"\$.version"),
        (("frame", "odom"), r"\$.frame"),
        (("landmarks", [{"type": "corner"}]), "missing required field `position`"),
        (("landmarks", [{"type": "pole"}]), r"\$.landmarks\[0\].type"),
        (("landmarks", [_ROW | {"descriptor": "abc"}]), "32 hexadecimal digits"),
    ],
)
def test_names_the_fault(tmp_path: Path, change: tuple[str, object], message: str) -> None:
    path = tmp_path / "landmarks.json"
    write_landmarks(path, _landmarks(1))
    path.write_text(json.dumps(json.loads(path.read_text()) | dict([change])))
    with pytest.raises(UserError, match=message):
        read_landmarks(path)


def test_refuses_what_is_no_json(tmp_path: Path) -> None:
    path = tmp_path / "landmarks.json"
    path.write_text('{"version": 1,')
    with pytest.raises(UserError, match="not a landmark map"):
        read_landmarks(path)

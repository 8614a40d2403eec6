from __future__ import annotations

import hashlib
import json
import os
import tomllib
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

import groma
from groma.errors import UserError
from groma.io.g2o import read_g2o
from groma.io.landmarks import read_landmarks
from groma.io.nav2_map import read_map
from groma.io.results import point_latest, result_directory, run_record, save_map, shown_command
from groma.io.trajectory import read_tum
from ring_corridor import ring_corridor

NOW = datetime(2031, 2, 3, 4, 5, 6)
FILES = {
    "trajectory.tum", "graph.g2o", "map.yaml", "map.pgm", "landmarks.json", "metrics.json", "run.toml", "report.html",
}  # fmt: skip


def _save(directory: Path, source: Path) -> dict[str, bytes]:
    directory.mkdir(exist_ok=True)
    save_map(ring_corridor(400), {"seed": 3, "scan": {"deskew": True}}, source, directory, "groma map day.log")
    return {path.name: path.read_bytes() for path in directory.iterdir()}


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "day.log"
    path.write_text("FLASER\n")
    return path


def test_same_result_same_bytes_and_nothing_else_is_left(tmp_path: Path, source: Path) -> None:
    first = _save(tmp_path / "a", source)
    assert set(first) == FILES
    assert _save(tmp_path / "b", source) == first
    assert _save(tmp_path / "a", source) == first


def test_every_file_reads_back_as_the_result(tmp_path: Path, source: Path) -> None:
    _save(tmp_path / "a", source)
    result, directory = ring_corridor(400), tmp_path / "a"
    np.testing.assert_allclose(read_tum(directory / "trajectory.tum").poses, result.trajectory, atol=3e-9)
    graph = read_g2o(directory / "graph.g2o")
    np.testing.assert_array_equal(graph.poses, result.graph.poses)
    np.testing.assert_array_equal(graph.information, result.graph.information)
    assert graph.fixed == (0,)
    np.testing.assert_array_equal(read_map(directory / "map.yaml").cells, result.grid.cells)
    np.testing.assert_array_equal(read_landmarks(directory / "landmarks.json").seen, result.landmarks.seen)
    metrics = json.loads((directory / "metrics.json").read_text())
    assert metrics["counts"]["scans_read"] == 6012
    assert list(metrics) == sorted(metrics)


def test_run_toml_tells_what_made_the_files(tmp_path: Path, source: Path) -> None:
    _save(tmp_path / "a", source)
    run = tomllib.loads((tmp_path / "a" / "run.toml").read_text())
    sha256 = hashlib.sha256(source.read_bytes()).hexdigest()
    assert run["input"] == {"name": "day.log", "bytes": 7, "sha256": sha256}
    assert run["settings"] == {"seed": 3, "scan": {"deskew": True}}
    assert (run["groma"], run["numpy"], run["command"]) == (groma.__version__, np.__version__, "groma map day.log")
    assert not any(part in (tmp_path / "a" / "run.toml").read_text() for part in tmp_path.parts[1:-1])


def test_a_folder_is_told_file_by_file(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    for name in ("metadata.yaml", "bag_0.db3"):
        (bag / name).write_text(name)
    record = run_record({}, bag, None)["input"]
    assert isinstance(record, dict)
    assert list(record["files"]) == ["bag_0.db3", "metadata.yaml"]


def test_without_an_input(tmp_path: Path) -> None:
    save_map(ring_corridor(100), {}, None, tmp_path)
    assert "input is unset" in (tmp_path / "run.toml").read_text()


def test_folders_are_named_by_time_and_never_reused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = result_directory(None, NOW), result_directory(None, NOW)
    assert (str(first), str(second)) == ("results/2031-02-03T04-05-06", "results/2031-02-03T04-05-06-2")
    for directory in (first, second):
        point_latest(directory)
        assert os.readlink("results/latest") == directory.name
        assert Path("results/latest").resolve() == directory.resolve()
    assert {path.name for path in Path("results").iterdir()} == {first.name, second.name, "latest"}


def test_latest_without_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError("a required privilege is not held by the client")

    monkeypatch.setattr(Path, "symlink_to", refuse)
    directory = result_directory(tmp_path / "stamp", NOW)
    point_latest(directory)
    assert (tmp_path / "latest.txt").read_text() == "stamp\n"


def test_an_existing_folder_is_taken_and_a_file_is_not(tmp_path: Path) -> None:
    assert result_directory(tmp_path, NOW) == tmp_path
    assert result_directory(tmp_path / "new" / "deep", NOW).is_dir()
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="is a file, not a folder"):
        result_directory(tmp_path / "file", NOW)
    with pytest.raises(UserError, match=r"file/below: cannot be made \(Not a directory\)"):
        result_directory(tmp_path / "file" / "below", NOW)


def test_the_command_is_recorded_without_places_and_threads() -> None:
    arguments = ["map", "a b.log", "-o", "out", "--threads=2", "--output=x", "--odometry", "none", "--threads", "4"]
    assert shown_command(arguments) == "groma map 'a b.log' --odometry none"

"""A real log of which the first half makes the map and the second is localized in it, start unknown."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from groma.features.association import rigid_fit
from groma.io.recording import open_recording, write_recording
from groma.localization.drive import Request, localize_drive
from groma.localization.result import Localized
from groma.mapping.mapper import map_drive
from groma.mapping.result import MapResult
from groma.nouns.maps import Chart
from groma.nouns.messages import Message
from groma.nouns.poses import relative
from groma.recordings.drive import open_drive

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Halves:
    """The map of the first half, the messages of the second, and the map of all, in the frame of the half."""

    half: MapResult
    second: list[Message]
    stamps: Array
    poses: Array

    def localize(self, seconds: float, folder: Path) -> tuple[Localized, Array]:
        """Localize the beginning of the second half; the errors against the map of all."""
        end = self.second[0].stamp + seconds
        path = folder / "second.mcap"
        write_recording(path, list(takewhile(lambda message: message.stamp <= end, self.second)))
        request = Request(Chart(self.half.landmarks, self.half.grid), {"mode": "static"})
        found = localize_drive(open_drive(open_recording(path)), request)
        return found, relative(_at(self.stamps, self.poses, found.stamps), found.poses)


def _at(stamps: Array, poses: Array, when: Array) -> Array:
    columns = (poses[:, 0], poses[:, 1], np.unwrap(poses[:, 2]))
    return np.column_stack([np.interp(when, stamps, column) for column in columns])


@pytest.fixture(scope="module")
def halves(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> Halves:
    log = shared / "data/intel/derived/intel_raw3361.clf.gz"
    messages = sorted(open_recording(log).messages(), key=lambda message: message.stamp)
    middle = messages[len(messages) // 2].stamp
    path = tmp_path_factory.mktemp("halves") / "first.mcap"
    write_recording(path, [message for message in messages if message.stamp <= middle])
    half, whole = map_drive(open_drive(open_recording(path)), {}), map_drive(open_drive(open_recording(log)), {})
    early = whole.trajectory_stamps <= half.trajectory_stamps[-1]
    first = _at(half.trajectory_stamps, half.trajectory, whole.trajectory_stamps[early])
    fit = rigid_fit(first[:, :2], whole.trajectory[early, :2])
    assert fit is not None
    x, y, turn = fit.transform
    c, s = np.cos(turn), np.sin(turn)
    poses = np.column_stack([whole.trajectory[:, :2] @ [[c, s], [-s, c]] + [x, y], whole.trajectory[:, 2] + turn])
    second = [message for message in messages if message.stamp > middle]
    return Halves(half, second, whole.trajectory_stamps, poses)


@pytest.mark.shared
def test_the_start_is_found_on_the_other_half_of_the_intel_log(halves: Halves, tmp_path: Path) -> None:
    found, errors = halves.localize(75.0, tmp_path)
    known = found.status != "lost"
    assert found.found_after is not None
    assert found.found_after < 5.0
    assert np.hypot(errors[known, 0], errors[known, 1]).max() < 0.35
    assert np.degrees(np.median(np.abs(errors[known, 2]))) < 4.0  # odometry lags in its fast turns


@pytest.mark.shared
@pytest.mark.slow
def test_the_other_half_of_the_intel_log_is_localized(halves: Halves, tmp_path: Path) -> None:
    found, errors = halves.localize(np.inf, tmp_path)
    known = found.status != "lost"
    distance = np.hypot(errors[known, 0], errors[known, 1])
    assert distance.max() < 0.6
    assert known.mean() > 0.33
    assert np.median(distance) < 0.12

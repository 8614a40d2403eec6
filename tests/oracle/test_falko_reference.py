"""FALKO against the authors' library with its defects corrected: every keypoint of 9320 scan runs.

The reference was made from the published definition with the true modulo in the ring distance, without merging of
candidates of equal score, and without the read past the last beam.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from groma.features import corners as features
from groma.nouns.arrays import Array
from groma.nouns.messages import BeamGeometry

pytestmark = pytest.mark.shared

LOGS = {"intel-lab": "intel/intel-lab.flirt.log.gz", "mit-csail": "mit-csail/mit-csail.flaser.clf.gz"}
SCANS = {"intel-lab": 2672, "mit-csail": 1988}
ROUNDING = 2e-6


def readings(log: Path) -> Iterator[Array]:
    """Ranges of the lines ``FLASER n r..`` and ``ROBOTLASER1 type start fov res max accuracy mode n r..``."""
    first = {"FLASER": 1, "ROBOTLASER1": 8}
    with gzip.open(log, "rt") as lines:
        for line in lines:
            words = line.split()
            at = first.get(words[0])
            if at is not None:
                yield np.array(words[at + 1 : at + 1 + int(words[at])], dtype=np.float64)


@pytest.mark.parametrize("a", [0.1, 0.2])
@pytest.mark.parametrize("name", LOGS)
def test_keypoints_equal_the_reference(shared: Path, name: str, a: float) -> None:
    with gzip.open(shared / "data" / "falko-reference" / f"{name}_a{a}.jsonl.gz", "rt") as lines:
        reference = [json.loads(line) for line in lines]
    scans = list(readings(shared / "data" / LOGS[name]))
    assert len(scans) == len(reference) == SCANS[name]
    beams = reference[0]["angle_min"], reference[0]["angle_increment"]
    geometry = BeamGeometry(*beams, time_increment=0, range_min=0, range_max=1e4)
    for found, line in zip(features.falko_batch(scans, geometry, a=a, definition="published"), reference, strict=True):
        expected = np.array(line["keypoints"]).reshape(-1, 5)
        np.testing.assert_array_equal(found.index, expected[:, 0], err_msg=f"scan {line['scan']}")
        np.testing.assert_allclose(found.point, expected[:, 1:3], rtol=0, atol=ROUNDING)
        turn = np.exp(1j * found.orientation) / np.exp(1j * expected[:, 3])
        np.testing.assert_allclose(np.angle(turn), 0, atol=ROUNDING)
        np.testing.assert_allclose(found.radius, expected[:, 4], rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("definition", ["published", "normalised"])
@pytest.mark.parametrize("name", LOGS)
def test_turning_or_mirroring_the_scanner_keeps_the_keypoints(
    shared: Path, name: str, definition: Literal["published", "normalised"]
) -> None:
    scans = list(readings(shared / "data" / LOGS[name]))
    step = np.pi / (len(scans[0]) - len(scans[0]) % 2)

    def found(angle_min: float, increment: float) -> list[features.Keypoints]:
        return features.falko_batch(scans, BeamGeometry(angle_min, increment, 0, 0, 1e4), definition=definition)

    before = found(-np.pi / 2, step)
    for angle in (0.7, 3.0, 2 * np.pi, -5.3):
        for a, b in zip(before, found(angle - np.pi / 2, step), strict=True):
            np.testing.assert_array_equal(a.index, b.index)
            turned = (a.point[:, 0] + 1j * a.point[:, 1]) * np.exp(1j * angle)
            np.testing.assert_allclose(turned, b.point[:, 0] + 1j * b.point[:, 1], rtol=0, atol=1e-12)
    for a, b in zip(before, found(np.pi / 2, -step), strict=True):
        np.testing.assert_array_equal(a.index, b.index)
        np.testing.assert_allclose(a.point, b.point * [1, -1], rtol=0, atol=1e-12)

"""`groma map` on real recordings: one set of defaults reaches the bars on all of them.

Relations of Intel: Kuemmerle et al. 2009, with the odometry of a particle filter for times without a scan.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from drives import mapped
from groma.evaluation.relations import RelationErrors, evaluate_relations, read_relations
from groma.io.trajectory import Trajectory, read_tum
from groma.mapping.result import MapResult
from groma.report.map.words import verdict

pytestmark = pytest.mark.shared


def errors(result: MapResult, relations: Path, fill_in: Path | None = None) -> RelationErrors:
    estimate = Trajectory(result.trajectory_stamps, result.trajectory)
    return evaluate_relations(read_relations(relations), estimate, read_tum(fill_in) if fill_in else None)


@pytest.mark.parametrize(("odometry", "metres", "degrees"), [(None, 0.078, 2.7), ("none", 0.10, 2.7)])
def test_intel(shared: Path, odometry: str | None, metres: float, degrees: float) -> None:
    intel = shared / "data/intel"
    result = mapped(intel / "derived/intel_raw3361.clf.gz", odometry=odometry)
    found = errors(result, intel / "intel.relations.gz", intel / "derived/intel_rbpf_dense.tum.gz")
    assert len(found.translation) == 2984
    assert found.translation.mean() < metres
    assert found.rotation.mean() < degrees


@pytest.mark.parametrize("odometry", [None, "none"])
def test_csail(shared: Path, odometry: str | None) -> None:
    csail = shared / "data/mit-csail"
    result = mapped(csail / "mit-csail.flaser.clf.gz", odometry=odometry)
    found = errors(result, csail / "csail_graph.relations.gz")
    assert len(found.translation) == 1197
    assert found.translation.mean() < 0.037
    assert found.rotation.mean() < 0.74


def test_loop5_closes_its_loop(shared: Path) -> None:
    result = mapped(shared / "data/dpslam-loop5/loop5.log.gz")
    times = [(c.from_stamp, c.to_stamp) for c in result.closures if c.accepted]
    length = result.trajectory_stamps[-1]
    assert any(first < 0.2 * length and last > 0.8 * length for first, last in times)
    assert verdict(result).startswith("The map is consistent")
    assert result.counts["path_m"] == pytest.approx(57, abs=3)

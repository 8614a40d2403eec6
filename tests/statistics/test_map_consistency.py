"""Are the uncertainties of a map honest? Monte-Carlo over buildings, drives and noise.

With the error of a node against the ground truth, both seen from the first node, as a right perturbation e, and its
covariance P,

    NEES = e^T P^-1 e,      NEES / 3 = 1 in the mean when P is the covariance of e

below 1 it is conservative. Nodes of one map are not independent, seeds are: the figures are means over all nodes of a
map, then over the seeds. Source: Y. Bar-Shalom et al., Estimation with Applications to Tracking and Navigation, 5.4.

groma means to err on the safe side, for a covariance that is too small lets loop closure reject what is true. The upper
bound is consistency; the lower one keeps the figures from saying nothing at all.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from drives import closure_errors, drive, mapped, node_errors, scene

pytestmark = pytest.mark.slow

SEEDS = (*range(1, 9), 12)
"""In the loop of seed 12 a corridor repeats, shifted by some doors."""
CHI_SQUARE_95 = 7.815
"""Of three degrees of freedom."""
BAND = (0.02, 1.0)
FALSE_M, FALSE_RAD = 0.3, math.radians(3)


@dataclass(frozen=True)
class Figures:
    """Of one map."""

    nees: float
    """Per degree of freedom, mean over the nodes."""
    coverage: float
    """Share of nodes within their 95 % ellipsoid."""
    closures: int
    false: int
    """Accepted closures that the truth contradicts."""
    error_m: float
    """Mean error of the true relative poses."""


def figures(name: str, seed: int, folder: Path) -> Figures:
    seconds = {"warehouse": 250.0, "loop": math.inf}.get(name, 300.0)
    driven = drive(scene(name, seed), seconds)
    result = mapped(driven.write(folder / f"{name}{seed}.mcap"))
    errors = node_errors(driven, result)[1:]
    nees = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(result.graph.covariances[1:]), errors)
    metres, radians = closure_errors(driven, result)
    false = int(np.count_nonzero((metres > FALSE_M) | (radians > FALSE_RAD)))
    return Figures(
        float(nees.mean() / 3),
        float(np.mean(nees < CHI_SQUARE_95)),
        len(metres),
        false,
        float(driven.errors(result).translation.mean()),
    )


@pytest.mark.parametrize("name", ["rooms", "turns", "warehouse", "loop"])
def test_the_covariances_are_consistent_and_no_closure_is_false(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = [figures(name, seed, tmp_path) for seed in SEEDS]
    with capsys.disabled():
        for seed, f in zip(SEEDS, found, strict=True):
            print(  # noqa: T201 (the figures are what the test is for)
                f"\n{name} {seed}: NEES/dof {f.nees:.3f}, in 95 % {f.coverage:.3f}, {f.closures} closures, "
                f"{f.false} false, mean error {f.error_m:.4f} m",
                end="",
            )
    assert BAND[0] < np.mean([f.nees for f in found]) < BAND[1]
    assert np.mean([f.coverage for f in found]) >= 0.95
    assert sum(f.false for f in found) == 0
    assert max(f.error_m for f in found) < 0.06

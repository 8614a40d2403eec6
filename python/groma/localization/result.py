"""The result of localizing a drive: values only, ready to be written, drawn or evaluated.

Frames: poses are ``T_map_base`` as ``(x, y, theta)``, in the frame of the map that was given. Covariances are those of
the body-frame perturbation ``T * exp(xi)``, ``xi = (x, y, theta)``. Stamps are those of the last beam of a scan, or of
the last motion where that came before the scan: a pose is where the vehicle was then.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groma.nouns.arrays import Array
from groma.nouns.findings import Finding
from groma.nouns.maps import Chart, Landmarks


@dataclass(frozen=True, slots=True)
class Halt:
    """A time during which the vehicle stood."""

    from_stamp: float
    to_stamp: float
    pose: tuple[float, float, float]
    """The last one."""
    sigma_m: float
    """Standard deviation of its position along the weakest direction."""
    scatter_m: float
    """Root mean square distance of the positions while standing from their mean."""
    matched: float
    """Landmarks paired with the map in the mean."""


@dataclass(frozen=True, slots=True)
class Weak:
    """A stretch of the drive where the pose is poorly held."""

    from_stamp: float
    to_stamp: float
    xy: tuple[float, float]
    """Where it is worst [m]."""
    sigma_m: float
    """Standard deviation of the position there."""
    why: str


@dataclass(frozen=True, slots=True)
class Localized:
    """Everything that ``groma localize`` writes."""

    chart: Chart
    stamps: Array
    """(K,) one per scan [s]."""
    poses: Array
    """(K, 3)."""
    covariances: Array
    """(K, 3, 3)."""
    status: NDArray[np.str_]
    """(K,) ``tracking``, ``coasting`` or ``lost``."""
    observed: NDArray[np.int64]
    """(K,) corners and reflectors of the scan."""
    matched: NDArray[np.int64]
    """(K,) of these, paired with landmarks that constrain the pose."""
    nis: Array
    """(K,) squared innovations."""
    dof: NDArray[np.int64]
    """(K,) their degrees of freedom."""
    sigma_position: Array
    """(K,) standard deviation along the weakest direction [m]."""
    sigma_heading: Array
    """(K,) [rad]."""
    geometry: Array
    """(K,) standard deviation along the weakest direction from the scan alone [m]; infinite below two landmarks."""
    way: Array
    """(K,) driven up to then, by the motions [m]."""
    extrapolated: Array
    """(K,) for how long the motion was extrapolated when the scan came [s]."""
    corrected: NDArray[np.bool_]
    """(K,) whether motions that came later set the pose right."""
    used: NDArray[np.int64]
    """(L,) how often each landmark of the map was paired."""
    halts: tuple[Halt, ...]
    weak: tuple[Weak, ...]
    seen: Landmarks | None
    """Landmarks seen on the way, at the poses found; None where no pose was known for long enough."""
    counts: dict[str, float]
    """Scans read and skipped with the reason, times the pose was lost and found, ..."""
    findings: tuple[Finding, ...]
    """What was noticed; the verdict follows from them."""

    @property
    def found_after(self) -> float | None:
        """Way until the pose was known [m]; None when it never was."""
        known = np.flatnonzero(self.status != "lost")
        return float(self.way[known[0]]) if len(known) else None

"""The result of localizing a drive: values only, ready to be written, drawn or evaluated.

Frames: poses are ``T_map_base`` as ``(x, y, theta)``, in the frame of the map that was given. Covariances are those of
the body-frame perturbation ``T * exp(xi)``, ``xi = (x, y, theta)``. Stamps are those of the last motion before the end
of a scan: a pose is where the vehicle was then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from groma.localization import State, Update
from groma.mapping import Landmarks, OccupancyGrid

Array = NDArray[np.float64]

STILL = (5e-4, 2e-4)
"""A vehicle that moved and turned by less between two scans stands [m, rad]."""
LEAST_HALT = 1.0
"""A halt lasts so long at least [s]."""
SETTLING = 0.3
"""Of a halt the first moments do not count [s]."""
LEAST_WEAK = 0.5
"""A weak stretch lasts so long at least [s]."""
OPEN = 0.1
"""A direction is open when the last scan alone holds it no better than this [m]."""
DISAGREES = 3.0
"""Landmarks disagree when the squared innovations are so many times what they should be."""


@dataclass(frozen=True, slots=True)
class Chart:
    """The map that a drive is localized in."""

    landmarks: Landmarks
    grid: OccupancyGrid | None = None
    """None where the map is a list of reflectors."""

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing on it."""
        return self.grid is None and not len(self.landmarks.seen)


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
    """(K,) one a scan [s]."""
    poses: Array
    """(K, 3)."""
    covariances: Array
    """(K, 3, 3)."""
    status: NDArray[np.str_]
    """(K,) ``tracking``, ``coasting`` or ``lost``."""
    observed: NDArray[np.int64]
    """(K,) corners and reflectors of the scan."""
    matched: NDArray[np.int64]
    """(K,) of these, paired with landmarks that hold the pose."""
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
    used: NDArray[np.int64]
    """(L,) how often each landmark of the map was paired."""
    halts: tuple[Halt, ...]
    weak: tuple[Weak, ...]
    counts: dict[str, float]
    """Scans read and skipped with the reason, times the pose was lost and found, ..."""

    @property
    def found_after(self) -> float | None:
        """Way until the pose was known [m]; None when it never was."""
        known = np.flatnonzero(self.status != "lost")
        return float(self.way[known[0]]) if len(known) else None


@dataclass(slots=True)
class Track:
    """Collects what a localizer says, scan by scan."""

    state: list[State] = field(default_factory=list)
    moved: list[tuple[float, float]] = field(default_factory=list)
    """Way [m] and turn [rad] since the scan before."""
    paired: list[NDArray[np.int64]] = field(default_factory=list)

    def add(self, state: State, update: Update, way: float, turn: float) -> None:
        """Take the state after a scan."""
        self.state.append(state)
        self.moved.append((way, turn))
        self.paired.append(update.landmark[update.holds])

    def result(self, chart: Chart, counts: Mapping[str, float]) -> Localized:
        """Return the value of the whole drive."""
        quality = [state.quality for state in self.state]
        size = len(chart.landmarks.positions)
        paired = np.concatenate(self.paired)
        columns: dict[str, Array] = {
            "stamps": np.array([state.stamp for state in self.state]),
            "poses": np.array([state.pose for state in self.state]),
            "covariances": np.array([state.covariance for state in self.state]),
            "sigma_position": np.array([q.sigma_position for q in quality]),
            "sigma_heading": np.array([q.sigma_heading for q in quality]),
            "geometry": np.array([q.geometry for q in quality]),
            "nis": np.array([q.nis for q in quality]),
            "way": np.cumsum([way for way, _ in self.moved]),
        }
        status = np.array([q.status for q in quality], dtype=np.str_)
        matched = np.array([q.matched for q in quality])
        dof = np.array([q.dof for q in quality])
        known = status != "lost"
        losses = int(np.sum(known[:-1] & ~known[1:]))
        return Localized(
            chart=chart,
            status=status,
            observed=np.array([q.observed for q in quality]),
            matched=matched,
            dof=dof,
            used=np.bincount(paired[paired < size], minlength=size),
            halts=_halts(columns, matched, self._stands()),
            weak=_weak(columns, status, dof),
            counts={**counts, "times_lost": losses},
            **columns,
        )

    def _stands(self) -> NDArray[np.bool_]:
        moved = np.array(self.moved)
        return (moved[:, 0] < STILL[0]) & (moved[:, 1] < STILL[1])


def _runs(flags: NDArray[np.bool_]) -> list[slice]:
    """Return the stretches in which a flag is set."""
    out, start = [], 0
    for value, group in groupby(flags.tolist()):
        length = len(list(group))
        if value:
            out.append(slice(start, start + length))
        start += length
    return out


def _halts(columns: Mapping[str, Array], matched: NDArray[np.int64], stands: NDArray[np.bool_]) -> tuple[Halt, ...]:
    stamps, poses = columns["stamps"], columns["poses"]
    halts = []
    for run in _runs(stands):
        begin, end = float(stamps[run][0]), float(stamps[run][-1])
        if end - begin < LEAST_HALT:
            continue
        settled = poses[run][stamps[run] >= begin + SETTLING]
        scatter = float(np.sqrt(settled[:, :2].var(axis=0).sum()))
        x, y, theta = poses[run][-1].tolist()
        sigma = float(columns["sigma_position"][run][-1])
        halts.append(Halt(begin, end, (x, y, theta), sigma, scatter, float(matched[run].mean())))
    return tuple(halts)


def _weak(columns: Mapping[str, Array], status: NDArray[np.str_], dof: NDArray[np.int64]) -> tuple[Weak, ...]:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(dof > 0, columns["nis"] / dof, 0.0)
    reasons = np.select(
        [status == "lost", status == "coasting", ratio > DISAGREES, columns["geometry"] > OPEN],
        ["the pose is not known", "no landmark holds the pose", "the landmarks disagree", "few landmarks in view"],
        "",
    )
    weak = []
    for reason in dict.fromkeys(r for r in reasons.tolist() if r):
        for run in _runs(reasons == reason):
            begin, end = float(columns["stamps"][run][0]), float(columns["stamps"][run][-1])
            if end - begin < LEAST_WEAK:
                continue
            worst = run.start + int(np.argmax(columns["sigma_position"][run]))
            x, y = columns["poses"][worst, :2].tolist()
            weak.append(Weak(begin, end, (x, y), float(columns["sigma_position"][worst]), reason))
    return tuple(sorted(weak, key=lambda spot: spot.from_stamp))

"""Short simulated drives for tests, their maps, and how far these are from the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from groma.evaluation.relations import RelationErrors, evaluate_relations
from groma.io.recording import open_recording, write_recording
from groma.io.trajectory import Trajectory
from groma.mapping.mapper import map_drive
from groma.mapping.result import MapResult
from groma.nouns.messages import LaserScan, Message
from groma.nouns.poses import relative, wrap
from groma.recordings.drive import open_drive
from groma.simulation.scenes import Scenario, Simulated, scenario, simulate, true_relations

Array = NDArray[np.float64]
Change = Callable[[list[Message]], Iterable[Message]]


@dataclass(frozen=True)
class Driven:
    """The first part of a simulated drive."""

    simulated: Simulated
    seconds: float

    @property
    def messages(self) -> list[Message]:
        end = self.simulated.scenario.start + self.seconds
        return [message for message in self.simulated if message.stamp <= end]

    @property
    def truth(self) -> Trajectory:
        """At the stamps of the scans."""
        last = int(np.searchsorted(self.simulated.scan_stamps, self.simulated.scenario.start + self.seconds, "right"))
        return Trajectory(self.simulated.scan_stamps[:last], self.simulated.scan_truth[:last])

    def write(self, path: Path, change: Change = list) -> Path:
        """Write it as a recording, changed."""
        write_recording(path, change(self.messages))
        return path

    def errors(self, result: MapResult) -> RelationErrors:
        """Errors of the true relative poses whose both times are in the map."""
        truth = true_relations(self.truth.stamps, self.truth.poses)
        return evaluate_relations(truth, Trajectory(result.trajectory_stamps, result.trajectory))


def scene(name: str, seed: int = 1, odometry_every: int = 5, **scanner: Any) -> Scenario:
    """A named scenario with some properties of its scanner changed."""
    full = scenario(name, seed)
    changed = msgspec.structs.replace(full.scanner, **scanner)
    return msgspec.structs.replace(full, scanner=changed, odometry_every=odometry_every)


def drive(scenario: Scenario, seconds: float = 1e9) -> Driven:
    """The first seconds of a drive, or all of it."""
    return Driven(simulate(scenario), seconds)


def scans(messages: Iterable[Message]) -> list[LaserScan]:
    return [message for message in messages if isinstance(message, LaserScan)]


def mapped(path: Path, odometry: str | None = None, **settings: object) -> MapResult:
    """What `groma map` makes of a recording."""
    return map_drive(open_drive(open_recording(path), odometry=odometry), settings)


def true_poses(driven: Driven, stamps: Array) -> Array:
    """The true poses at stamps of scans."""
    index = np.searchsorted(driven.truth.stamps, stamps - 1e-6)
    assert np.allclose(driven.truth.stamps[index], stamps, atol=1e-6)
    return driven.truth.poses[index]


def closure_errors(driven: Driven, result: MapResult) -> tuple[Array, Array]:
    """How far the accepted closures are from the truth [m], [rad]."""
    chosen = np.array(result.graph.kinds) == "closure"
    first, second = result.graph.pairs[chosen].T
    truth = true_poses(driven, result.graph.stamps)
    error = relative(relative(truth[first], truth[second]), result.graph.measurements[chosen])
    return np.hypot(error[:, 0], error[:, 1]), np.abs(error[:, 2])


def node_errors(driven: Driven, result: MapResult) -> Array:
    """(N, 3) right perturbations that the nodes, seen from the first, are off the truth."""
    truth = true_poses(driven, result.graph.stamps)
    from_first = relative(truth[:1], truth)
    return logarithm(relative(from_first, relative(result.graph.poses[:1], result.graph.poses)))


def logarithm(poses: Array) -> Array:
    """Return the twists (N, 3) of poses (N, 3): t = V rho, V^-1 = [[a, h], [-h, a]], h = theta/2, a = h / tan h."""
    theta = wrap(poses[:, 2])
    h = theta / 2
    safe = np.where(np.abs(h) < 1e-9, 1.0, h)
    a = np.where(np.abs(h) < 1e-9, 1.0, safe / np.tan(safe))
    x, y = poses[:, 0], poses[:, 1]
    return np.column_stack([a * x + h * y, a * y - h * x, theta])

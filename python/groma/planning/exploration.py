"""Which way to drive next through a building whose cameras are to be mapped: distance against uncertainty.

The core (``crates/planning``, ``docs/theory/planning.md``) does the work; here are its nouns, its defaults and two
things to do with them: explore a graph, and try a walk out with drawn noise. A robot is led live by
:class:`groma.planning.explorer.Explorer`.

>>> graph = scene("ring", size=8, step=6.25)
>>> run = explore(graph, Settings(goal=Lambda(30.0)))
>>> round(run.length), len(run.cameras)
(49, 8)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Literal

import msgspec

from groma import _core
from groma.errors import UserError
from groma.nouns.building import Graph
from groma.planning.core_calls import call, to_json

StrategyName = Literal["depth-first", "nearest", "return-to-origin", "return-to-nearest", "cheap", "search", "survey"]
STRATEGIES: tuple[StrategyName, ...] = (
    "depth-first",
    "nearest",
    "return-to-origin",
    "return-to-nearest",
    "cheap",
    "search",
    "survey",
)
RULES = STRATEGIES[:4]
"""Those that lambda does not lead."""
WEIGHING = STRATEGIES[4:]
"""Those that lambda leads."""
SceneName = Literal["corridor", "ring", "squares", "rectangles", "triangles", "hexagons", "sparse"]


class Noise(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations: of driving a metre, of turning a radian, of one look at a camera."""

    along: float
    across: float
    heading: float
    turn: float
    position: float
    bearing: float


class Limits(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How long to think: walks expanded a decision, passages of one way in a walk."""

    expansions: int
    passes: int


class Lambda(msgspec.Struct, frozen=True):
    """Metres of driving traded for one square metre less of summed variance [1/m]."""

    value: float


class Sigma(msgspec.Struct, frozen=True):
    """Root mean square standard deviation of the cameras' positions to reach [m]."""

    value: float


class Budget(msgspec.Struct, frozen=True):
    """Distance to spend [m]."""

    value: float


Goal = Lambda | Sigma | Budget


class _Defaults(msgspec.Struct, frozen=True):
    noise: Noise
    strategy: StrategyName
    goal: dict[str, float]
    limits: Limits


DEFAULTS = msgspec.json.decode(_core.exploration_defaults(), type=_Defaults)


class Settings(msgspec.Struct, frozen=True):
    """How to explore; the defaults are those of the core."""

    goal: Goal = Lambda(DEFAULTS.goal["lambda"])
    strategy: StrategyName = DEFAULTS.strategy
    noise: Noise = DEFAULTS.noise
    limits: Limits = DEFAULTS.limits

    def table(self) -> dict[str, object]:
        """Return all values by name, as the core and ``run.toml`` have them."""
        name, value = type(self.goal).__name__.lower(), float(self.goal.value)
        if not math.isfinite(value):
            raise UserError(f"{name} = {value}: must be finite")
        goal = {name: value}
        fixed = {"noise": msgspec.to_builtins(self.noise), "limits": msgspec.to_builtins(self.limits)}
        return {"strategy": self.strategy, "goal": goal, **fixed}


class Stop(msgspec.Struct, frozen=True):
    """Where the robot came to, and what was known then; covariances as xx, xy, yy [m^2]."""

    node: int
    edge: int | None
    length: float
    robot: tuple[float, float, float]
    heading: float
    sigma: float
    complete: bool
    cameras: tuple[tuple[float, float, float], ...]


class Decision(msgspec.Struct, frozen=True):
    """What one search took, and by what share of its cost a better walk could be cheaper."""

    expansions: int
    gap: float


class Run(msgspec.Struct, frozen=True):
    """A whole exploration: stops, cameras in the order in which they were found, distance [m], sigma [m]."""

    stops: tuple[Stop, ...]
    cameras: tuple[int, ...]
    length: float
    sigma: float
    decisions: tuple[Decision, ...]

    @property
    def walk(self) -> list[int]:
        """The ways driven, one after the other."""
        return [stop.edge for stop in self.stops if stop.edge is not None]


class Errors(msgspec.Struct, frozen=True):
    """How far maps were off: the cameras, root mean square [m]; the normalised squared error over its freedom."""

    sigma: float
    nees: float


class Tried(msgspec.Struct, frozen=True):
    """What noisy drives gave: errors of the maps by least squares over the whole drive, and of the filter's own."""

    map: Errors
    filter: Errors
    runs: int


def scene(kind: SceneName, *, size: int = 16, step: float = 8.0, density: float = 0.7, seed: int = 0) -> Graph:
    """Return an idealised building.

    Parameters
    ----------
    kind
        Its shape.
    size
        Number of cameras; lattices of triangles and hexagons have the nearest that they can.
    step
        Length of a way [m].
    density
        Of sparse: the share of the ways beyond a tree, 0 to 1.
    seed
        Of sparse: draws the ways.

    Raises
    ------
    UserError
        When a value is out of range.
    """
    for name, value in (("size", size), ("seed", seed)):
        if value < 0:
            raise UserError(f"{name} = {value}: must not be negative")
    for name, length in (("step", step), ("density", density)):
        if not math.isfinite(length):
            raise UserError(f"{name} = {length}: must be finite")
    values = {"kind": kind, "size": size, "step": step, "density": density, "seed": seed}
    return call(lambda: msgspec.json.decode(_core.exploration_scene(to_json(values)), type=Graph))


def explore(
    graph: Graph,
    settings: Settings | None = None,
    progress: Callable[[float, int], object] | None = None,
    token: _core.Token | None = None,
) -> Run:
    """Let a robot that does not know a building explore it; nothing is drawn, all noise is in the covariances.

    Parameters
    ----------
    graph
        The building.
    settings
        How to explore.
    progress
        Called at each stop with the distance driven [m] and the number of cameras found.
    token
        Cancels the work; KeyboardInterrupt tells so.

    Raises
    ------
    UserError
        When the graph cannot be driven or a setting is impossible.
    """
    chosen = to_json((settings or Settings()).table())
    asked = graph.json(), chosen, progress, token
    return call(lambda: msgspec.json.decode(_core.exploration_run(*asked), type=Run))


def try_walk(
    graph: Graph,
    walk: Iterable[int],
    *,
    noise: Noise | None = None,
    runs: int = 200,
    seed: int = 1,
    progress: Callable[[int, int], object] | None = None,
    token: _core.Token | None = None,
) -> Tried:
    """Drive a walk (ways from the start) many times with drawn noise: the filter, then least squares over the drive.

    Parameters
    ----------
    graph
        The building.
    walk
        The ways, one after the other.
    noise
        Standard deviations; the default ones when left out.
    runs
        How often.
    seed
        Of the first; each has its own.
    progress
        Called before each drive with those done and their number.
    token
        Cancels the work; KeyboardInterrupt tells so.

    Examples
    --------
    >>> graph = scene("ring", size=8, step=6.25)
    >>> run = explore(graph)
    >>> 0.85 < try_walk(graph, run.walk).map.sigma / run.sigma < 1.15
    True

    Raises
    ------
    UserError
        When the walk jumps, or runs or seed are negative.
    """
    if runs < 1 or seed < 0:
        raise UserError(f"runs = {runs}, seed = {seed}: need at least 1 and 0")
    asked = graph.json(), list(walk), to_json(noise or DEFAULTS.noise), runs, seed, progress, token
    return call(lambda: msgspec.json.decode(_core.exploration_try(*asked), type=Tried))

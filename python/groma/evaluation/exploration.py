"""How strategies trade distance for accuracy, over many buildings: means, and bands in which the means lie with 95 %.

A rule without a weight is one point. `matched` asks for the curve at that very point: in each building the survey gets
the distance that the rule drove there, and the two sigmas are compared building by building.

The band of a mean over n buildings is `mean +- t_{0.975, n-1} s / sqrt(n)`; it says how well the mean over the kind of
building is known, not how much buildings differ. With one building there is no band.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from groma._core import Token
from groma.nouns.building import Graph
from groma.planning.exploration import (
    RULES,
    STRATEGIES,
    WEIGHING,
    Budget,
    Lambda,
    SceneName,
    Settings,
    StrategyName,
    explore,
    scene,
)

LAMBDAS = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Metres of driving traded for one square metre of summed variance, from hasty to thorough."""
_T = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131)
"""Student's t, 0.975, from 1 degree of freedom on; beyond, 1.96 + 2.5 / dof is right to 0.2 %."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """What strategies are compared on when no buildings are given: idealised ones, and the weights to try."""

    scene: SceneName = "sparse"
    size: int = 16
    """Cameras of a building."""
    step: float = 8.0
    """Distance between neighbouring cameras [m]."""
    density: float = 0.7
    """Of sparse buildings: share of the edges beyond a tree."""
    buildings: int = 12
    """How many are drawn, with the seeds 0, 1, ...; only sparse ones differ."""
    lambdas: tuple[float, ...] = LAMBDAS

    def scenes(self) -> list[Graph]:
        """Return the buildings."""
        seeds = range(self.buildings if self.scene == "sparse" else 1)
        return [scene(self.scene, size=self.size, step=self.step, density=self.density, seed=seed) for seed in seeds]


@dataclass(frozen=True, slots=True)
class Traded:
    """What a strategy gives in the mean over buildings; bands are half widths, NaN for one building."""

    strategy: StrategyName
    weight: float | None
    """Lambda, None for a rule that has none."""
    distance: float
    distance_band: float
    sigma: float
    sigma_band: float


def trade_offs(
    graphs: Sequence[Graph],
    lambdas: Sequence[float] = LAMBDAS,
    strategies: Sequence[StrategyName] = STRATEGIES,
    progress: Callable[[int, int], None] | None = None,
    token: Token | None = None,
) -> list[Traded]:
    """Explore every building by every strategy, those that weigh once for every lambda.

    Parameters
    ----------
    graphs
        At least one.
    lambdas
        For the strategies that weigh.
    strategies
        Which to compare.
    progress
        Called with the number of curves' points done and their total.
    token
        Cancels the work; KeyboardInterrupt tells so.
    """
    plans = list(_plans(lambdas, strategies))
    points = []
    for number, (strategy, weight) in enumerate(plans):
        settings = Settings(strategy=strategy, goal=Lambda(0.0 if weight is None else weight))
        runs = [explore(graph, settings, token=token) for graph in graphs]
        distance, sigma = np.array([run.length for run in runs]), np.array([run.sigma for run in runs])
        means = float(distance.mean()), band(distance), float(sigma.mean()), band(sigma)
        points.append(Traded(strategy, weight, *means))
        if progress:
            progress(number + 1, len(plans))
    return points


@dataclass(frozen=True, slots=True)
class Matched:
    """A rule, and the survey that drives as far in each building."""

    rule: StrategyName
    distance: float
    """Mean of the rule [m]."""
    survey_distance: float
    """Mean of the survey [m]: at most the rule's, but where finding all cameras takes more."""
    sigma: float
    """Mean of the rule [m]."""
    survey_sigma: float
    """Mean of the survey [m]."""
    difference_band: float
    """Half width of the 95 % band of the mean difference of the two sigmas [m]; NaN for one building."""
    better: int
    """Buildings in which the survey's sigma is the smaller one."""


def matched(
    graphs: Sequence[Graph],
    rules: Sequence[StrategyName] = RULES,
    progress: Callable[[int, int], None] | None = None,
    token: Token | None = None,
) -> list[Matched]:
    """Explore every building by rules without a weight, and survey it with the distance that each took.

    Parameters
    ----------
    graphs
        At least one.
    rules
        To compare with.
    progress
        Called with the number of rules done and their total.
    token
        Cancels the work; KeyboardInterrupt tells so.
    """
    found = []
    for number, rule in enumerate(rules):
        ruled = [explore(graph, Settings(strategy=rule), token=token) for graph in graphs]
        surveyed = [
            explore(graph, Settings(strategy="survey", goal=Budget(run.length)), token=token)
            for graph, run in zip(graphs, ruled, strict=True)
        ]
        sigmas = np.array([[a.sigma, b.sigma] for a, b in zip(ruled, surveyed, strict=True)])
        difference = sigmas[:, 1] - sigmas[:, 0]
        lengths = _mean(run.length for run in ruled), _mean(run.length for run in surveyed)
        means = float(sigmas[:, 0].mean()), float(sigmas[:, 1].mean())
        found.append(Matched(rule, *lengths, *means, band(difference), int((difference < 0.0).sum())))
        if progress:
            progress(number + 1, len(rules))
    return found


def band(values: np.typing.NDArray[np.float64]) -> float:
    """Return the half width of the 95 % band of a mean; NaN for one value."""
    freedom = len(values) - 1
    if freedom < 1:
        return math.nan
    quantile = _T[freedom - 1] if freedom <= len(_T) else 1.96 + 2.5 / freedom
    return float(quantile * values.std(ddof=1) / math.sqrt(len(values)))


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def _plans(lambdas: Sequence[float], strategies: Sequence[StrategyName]) -> Iterator[tuple[StrategyName, float | None]]:
    for strategy in strategies:
        weights: Sequence[float | None] = lambdas if strategy in WEIGHING else (None,)
        yield from ((strategy, weight) for weight in weights)

"""The tables of settings, one a command: their names in files and their defaults, which are those of the core.

`groma config` prints them, ``--config`` takes them back, and ``run.toml`` has the one of its run. A setting without a
default is None; a file leaves it out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

import msgspec

from groma.camera_calibration import camera_defaults
from groma.camera_plan import DEFAULTS, Search
from groma.errors import UserError
from groma.evaluation.association import Matching
from groma.evaluation.exploration import LAMBDAS, Comparison
from groma.exploration import Budget, Goal, Lambda, Limits, Noise, Sigma, StrategyName
from groma.exploration import Settings as Exploration
from groma.localization_simulation import Rounds
from groma.localize import localize_defaults
from groma.mapper import map_defaults
from groma.network import network_defaults
from groma.promotion import promotion_defaults
from groma.settings import Settings, chosen
from groma.vehicle_calibration import Request
from groma.vehicle_plan import plan_limits
from groma.vehicle_simulation import Course
from groma.vision import detection_defaults

T = TypeVar("T")

RECORDED: Mapping[str, tuple[str, ...]] = {
    "camera": ("name", "target"),
    "plan_camera": ("mount", "start", "target", "camera"),
    "exploration": ("scene", "size", "step", "density"),
    "simulate_cameras": ("scene",),
}
"""What run.toml has in a table besides settings: it says what the run was made of, and is not taken back."""


def tables() -> dict[str, Callable[[], Settings]]:
    """Return what gives the defaults of each table."""
    return {
        "map": map_defaults,
        "localize": _localize,
        "promote": promotion_defaults,
        "calibrate": _calibrate,
        "camera": lambda: {**camera_defaults(), "detection": detection_defaults()},
        "cameras": network_defaults,
        "plan_vehicle": _plan_vehicle,
        "plan_camera": lambda: search_table(DEFAULTS.search),
        "exploration": lambda: {**Exploration().table(), "seed": 0},
        "evaluate_exploration": lambda: {**msgspec.to_builtins(Comparison()), "lambdas": list(LAMBDAS)},
        "motions": _motions,
        "features": lambda: {"every": 3},
        "trajectory": lambda: msgspec.to_builtins(Matching()),
        "node": lambda: {"rate": 0.0},
        "simulate": lambda: {"seed": 1},
        "simulate_vehicle": lambda: msgspec.to_builtins(Course()),
        "simulate_localization": lambda: msgspec.to_builtins(Rounds()),
        "simulate_cameras": lambda: {"seed": 1, "images": False},
    }


def settings_of(table: str, config: Path | None, **options: object) -> Settings:
    """Return the settings of a command: its defaults, changed by a file, changed by the options that are not None.

    Raises
    ------
    UserError
        As :func:`groma.settings.chosen`.
    """
    return chosen(tables()[table](), config, table, options, RECORDED.get(table, ()))


def _localize() -> Settings:
    return {"start": "unknown", "scan_stream": None, "odometry_stream": None, **localize_defaults()}


def _calibrate() -> Settings:
    request = {key: list(value) if isinstance(value, tuple) else value for key, value in asdict(Request()).items()}
    return {**request, "tolerance": ""}


def _plan_vehicle() -> Settings:
    return {**plan_limits(), "tolerance": "", "free": [], "footprint": "", "nseg": None}


def _motions() -> Settings:
    tries = DEFAULTS.tries
    given = {"runs": tries.runs, "views": tries.views, "seed": tries.seed}
    return {"height": 2.0, "distance": 2.6, **given, "errors": False}


def search_table(search: Search) -> Settings:
    """Return the settings of a search for drives before a camera by name."""
    noise = msgspec.to_builtins(search.noise)
    return {
        "sigma": search.target,
        "depth": list(search.depth),
        "side": search.side,
        "lambda": search.lambda_,
        "drives": search.drives,
        "noise": noise,
    }


def typed(kind: type[T], settings: Settings, table: str) -> T:
    """Return the settings of a table as the type that has their defaults.

    Raises
    ------
    UserError
        When a value has another form.
    """
    try:
        return msgspec.convert(settings, kind)
    except msgspec.ValidationError as error:
        raise UserError(f"setting of {table}: {error}") from error


def search_of(settings: Settings) -> Search:
    """Return the search of a table [plan_camera].

    Raises
    ------
    UserError
        When a value has another form.
    """
    given = {"target" if name == "sigma" else name: value for name, value in settings.items()}
    return typed(Search, given, "plan_camera")


def goal_table(goal: Goal) -> dict[str, object]:
    """Return a goal of an exploration by name."""
    return {type(goal).__name__.lower(): goal.value}


def exploration_of(settings: Settings) -> Exploration:
    """Return the exploration of a table [exploration]; its goal is that of the core where it is None.

    Raises
    ------
    UserError
        When a value has another form.
    """
    goal, kinds = settings["goal"], {"lambda": Lambda, "sigma": Sigma, "budget": Budget}
    try:
        found = Exploration(
            strategy=msgspec.convert(settings["strategy"], StrategyName),
            noise=msgspec.convert(settings["noise"], Noise),
            limits=msgspec.convert(settings["limits"], Limits),
        )
        if goal is None:
            return found
        ((kind, value),) = msgspec.convert(goal, dict[str, float]).items()
        return msgspec.structs.replace(found, goal=kinds[kind](value))
    except (msgspec.ValidationError, KeyError, ValueError) as error:
        raise UserError(f"setting of exploration: {error}") from error

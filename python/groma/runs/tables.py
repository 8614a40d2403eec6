"""The tables of settings, one a command: their names in files and their defaults, which are those of the core.

`groma config` prints them, ``--config`` takes them back, and ``run.toml`` has the one of its run. A setting without a
default is None; a file leaves it out. A command needs one of them: the modules of the others are not read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import msgspec

from groma.errors import UserError
from groma.runs.settings import Settings, chosen

if TYPE_CHECKING:
    from groma.planning.camera import Search
    from groma.planning.exploration import Goal
    from groma.planning.exploration import Settings as Exploration

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
        "map": _given("groma.mapping.mapper", "map_defaults"),
        "localize": _localize,
        "promote": _given("groma.mapping.promotion", "promotion_defaults"),
        "calibrate": _calibrate,
        "camera": _camera,
        "cameras": _given("groma.cameras.network", "network_defaults"),
        "plan_vehicle": _plan_vehicle,
        "plan_camera": lambda: search_table(_of("groma.planning.camera", "DEFAULTS").search),
        "exploration": lambda: {**_of("groma.planning.exploration", "Settings")().table(), "seed": 0},
        "evaluate_exploration": _built("groma.evaluation.exploration", "Comparison"),
        "motions": _motions,
        "features": lambda: {"every": 3},
        "trajectory": _built("groma.evaluation.association", "Matching"),
        "node": lambda: {"rate": 0.0},
        "simulate": lambda: {"seed": 1},
        "simulate_vehicle": _built("groma.simulation.vehicle", "Course"),
        "simulate_localization": _built("groma.simulation.localization", "Rounds"),
        "simulate_cameras": lambda: {"seed": 1, "images": False},
    }


def settings_of(table: str, config: Path | None, **options: object) -> Settings:
    """Return the settings of a command: its defaults, changed by a file, changed by the options that are not None.

    Raises
    ------
    UserError
        As :func:`groma.runs.settings.chosen`.
    """
    return chosen(tables()[table](), config, table, options, RECORDED.get(table, ()))


def _of(module: str, name: str) -> Any:
    return getattr(import_module(module), name)


def _given(module: str, function: str) -> Callable[[], Settings]:
    """Return what a function gives, its module read on request."""
    return lambda: _of(module, function)()


def _built(module: str, kind: str) -> Callable[[], Settings]:
    """Return the defaults of a struct by name, its module read when they are requested."""
    return lambda: _plain(_of(module, kind)())


def _plain(defaults: object) -> Settings:
    """Return a struct as tables and lists."""
    return cast(Settings, msgspec.json.decode(msgspec.json.encode(defaults)))


def _localize() -> Settings:
    defaults = _of("groma.localization.drive", "localize_defaults")()
    return {"start": "unknown", "scan_stream": None, "odometry_stream": None, **defaults}


def _camera() -> Settings:
    detection = _of("groma.cameras.vision", "detection_defaults")()
    return {**_of("groma.cameras.calibration", "camera_defaults")(), "detection": detection}


def _calibrate() -> Settings:
    return {**_plain(_of("groma.vehicle.recording", "Request")()), "tolerance": ""}


def _plan_vehicle() -> Settings:
    return {
        **_of("groma.planning.vehicle", "plan_limits")(),
        "tolerance": "",
        "free": [],
        "footprint": "",
        "nseg": None,
    }


def _motions() -> Settings:
    tries = _of("groma.planning.camera", "DEFAULTS").tries
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
    from groma.planning.camera import Search

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
    from groma.planning.exploration import Budget, Lambda, Limits, Noise, Sigma, StrategyName
    from groma.planning.exploration import Settings as Exploration

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

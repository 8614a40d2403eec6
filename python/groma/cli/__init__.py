"""The command `groma`: one verb, one file. Verbs are imported when called, so that help is instant.

Exit codes: 0 done, 1 there is no estimate or it must not be relied on, 2 the user's mistake, 130 interrupted before
there was a result. Anything else is a bug and shows its traceback.
"""

from __future__ import annotations

import ast
import sys
from importlib.util import find_spec
from pathlib import Path

from cyclopts import App, CycloptsError

import groma
from groma.cli.parameters import PLAIN
from groma.errors import EstimationError, ToldError, UserError
from groma.runs.record import printable

GROUPS = {
    "": {
        "demo": "demo:demo",
        "inspect": "inspect:inspect",
        "map": "map:map_",
        "localize": "localize:localize",
        "promote": "promote:promote",
        "simulate": "simulate:app",
        "config": "config:config",
    },
    "calibrate": {"vehicle": "calibrate_vehicle:vehicle", "camera": "calibrate_camera:camera"},
    "cameras": {"map": "cameras_map:map_", "node": "cameras_node:node", "survey": "cameras_survey:survey"},
    "plan": {
        "vehicle": "plan_vehicle:vehicle",
        "camera": "plan_camera:camera",
        "exploration": "plan_exploration:exploration",
    },
    "evaluate": {
        "exploration": "evaluate_exploration:exploration",
        "features": "evaluate_features:features",
        "loops": "evaluate_loops:loops",
        "motions": "evaluate_motions:motions",
        "trajectory": "evaluate_trajectory:trajectory",
    },
}
"""Verbs by group: their names, and where they are found in this package."""

_HELP = {
    "calibrate": "Estimate what a vehicle or a camera is like from a recording.",
    "cameras": "Map the fixed cameras of a building with a robot that carries a target.",
    "plan": "Say where to drive, such that what is mapped or calibrated becomes as accurate as required.",
    "evaluate": "Compare estimates with references.",
}


def build(summaries: bool = False) -> App:
    """Return the commands; with summaries their first lines are looked up for a list of them, without an import."""
    whole = App(
        name="groma",
        help=groma.__doc__,
        version=groma.__version__,
        default_parameter=PLAIN,
        suppress_keyboard_interrupt=False,
    )
    for group, verbs in GROUPS.items():
        parent = App(name=group, help=_HELP[group], default_parameter=PLAIN) if group else whole
        for name, place in verbs.items():
            target = f"{__name__}.{place}"
            if summaries:
                parent.command(target, name=name, help=summary(target))
            else:
                parent.command(target, name=name)
        if group:
            whole.command(parent)
    return whole


def summary(target: str) -> str:
    """Return the first line of the docstring of a verb, or of the default verb of an app.

    Parameters
    ----------
    target
        As ``package.module:name``.
    """
    module, _, name = target.partition(":")
    found = find_spec(module)
    if found is None or found.origin is None:
        return ""
    functions = [
        node for node in ast.parse(Path(found.origin).read_text("utf-8")).body if isinstance(node, ast.FunctionDef)
    ]
    chosen = [f for f in functions if f.name == name] or [f for f in functions if f.decorator_list]
    return (ast.get_docstring(chosen[0]) or "").partition("\n")[0] if chosen else ""


def _asks_what_there_is(arguments: list[str]) -> bool:
    words = [word for word in arguments if word not in ("--help", "-h")]
    return not words or (len(words) == 1 and words[0] in _HELP)


app = build()


def main() -> None:
    """Run the command line and exit."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        chosen = build(summaries=True) if _asks_what_there_is(arguments) else app
        chosen(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except CycloptsError:
        return 2
    except UserError as error:
        print(f"groma: {printable(str(error))}", file=sys.stderr)
        return 2
    except ToldError:
        return 1
    except EstimationError as error:
        print(f"groma: {printable(str(error))}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("groma: interrupted before there was a result: nothing was changed", file=sys.stderr)
        return 130
    except BrokenPipeError:
        sys.stderr.close()
    return 0

"""The command `groma`: one verb, one file. Verbs are imported when called, so that help is instant.

Exit codes: 0 done, 1 the estimation failed, 2 the user's mistake. Anything else is a bug and shows its traceback.
"""

from __future__ import annotations

import sys

from cyclopts import App, CycloptsError

import groma
from groma.errors import EstimationError, UserError

app = App(name="groma", help=groma.__doc__, version=groma.__version__)
evaluate = App(name="evaluate", help="Compare estimates with references.")
app.command(evaluate)
calibrate = App(name="calibrate", help="Estimate what a vehicle or a camera is like from a recording.")
app.command(calibrate)
cameras = App(name="cameras", help="Map the fixed cameras of a building with a robot that carries a target.")
app.command(cameras)

app.command("groma.cli.demo:demo")
app.command("groma.cli.inspect:inspect")
app.command("groma.cli.map:map_", name="map")
app.command("groma.cli.simulate:app", name="simulate")
app.command("groma.cli.localize:localize")
app.command("groma.cli.promote:promote")
app.command("groma.cli.config:config")
calibrate.command("groma.cli.calibrate_vehicle:vehicle")
cameras.command("groma.cli.cameras_map:map_", name="map")
calibrate.command("groma.cli.calibrate_camera:camera")
plan.command("groma.cli.plan_vehicle:vehicle")
plan.command("groma.cli.plan_exploration:exploration")
evaluate.command("groma.cli.evaluate_exploration:exploration")
cameras.command("groma.cli.cameras_node:node")
cameras.command("groma.cli.cameras_survey:survey")
evaluate.command("groma.cli.evaluate_features:features")
evaluate.command("groma.cli.evaluate_loops:loops")
evaluate.command("groma.cli.evaluate_trajectory:trajectory")


def main() -> None:
    """Run the command line and exit."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except CycloptsError:
        return 2
    except UserError as error:
        print(f"groma: {error}", file=sys.stderr)
        return 2
    except EstimationError as error:
        print(f"groma: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        sys.stderr.close()
    return 0

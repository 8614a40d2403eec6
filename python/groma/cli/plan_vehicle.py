"""`groma plan vehicle`: which arcs to drive to calibrate a vehicle."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, cast

import numpy as np
from cyclopts import Parameter

from groma.errors import UserError
from groma.io.quantities import amounts
from groma.io.vehicle_file import read_vehicle
from groma.nouns.arrays import Array
from groma.planning.vehicle import PlanLimits, plan_limits, plan_vehicle, thesis_grid
from groma.runs.kinds import file_in
from groma.runs.run import Run
from groma.runs.settings import Settings, chosen
from groma.runs.tables import tables
from groma.runs.vehicle_plan import plan_vehicle_into
from groma.vehicle.calibration import interval_factor


def vehicle(
    *,
    tolerance: str | None = None,
    vehicle: Annotated[Path | None, Parameter(alias="-v")] = None,
    wheelbase: float | None = None,
    laser: str = "0,0,0",
    floor: str = "",
    footprint: str | None = None,
    free: str | None = None,
    alpha_min: float | None = None,
    alpha_max: float | None = None,
    beta_max: float | None = None,
    path_max: float | None = None,
    speed: float | None = None,
    acceleration_max: float | None = None,
    overhead: float | None = None,
    nseg: int | None = None,
    output: Annotated[Path | None, Parameter(alias="-o")] = None,
    config: Path | None = None,
) -> None:
    """Plan the arcs that calibrate a vehicle in the least time: a table, plan.csv and plan.png.

    groma plan vehicle --wheelbase 1.5 --tolerance laser_x=1mm,laser_y=1mm,drive_scale=0.02% --path-max 4

    Parameters
    ----------
    tolerance
        Half-widths of 95 % intervals wanted, as name=number with mm, m, deg, rad or %, separated by commas.
    vehicle
        vehicle.toml, about: of a calibration before, or from the drawing.
    wheelbase
        Of a tricycle, instead of a file [m].
    laser
        Where the laser sits about, instead of a file: x,y,yaw [m, m, deg].
    floor
        Corners of the floor, as "0,0 10,0 10,8 0,8" or a CSV file of x,y lines [m]; room enough when left out.
    footprint
        Reach of the vehicle on the floor ahead of its base, behind it, and to either side: front,rear,side [m].
    free
        What is estimated too: wheelbase, gain, separated by commas.
    alpha_min
        Least steering angle to either side [deg].
    alpha_max
        Largest steering angle to either side [deg].
    beta_max
        Largest turn of the vehicle in an arc; that of all arcs with --nseg [deg].
    path_max
        Longest path of a wheel in an arc [m].
    speed
        Speed of the drive wheel [m/s].
    acceleration_max
        Largest lateral acceleration [m/s^2].
    overhead
        Time that an arc takes beside driving [s].
    nseg
        Lay out the grid of the thesis instead, of so many steering angles.
    output
        Folder for the results; a new one in results/ when left out.
    config
        TOML with a table [plan_vehicle] (groma config prints it) or the run.toml of another run.
    """
    limits = _limits(alpha_min, alpha_max, beta_max, path_max, speed, acceleration_max, overhead)
    names = None if free is None else [name.strip() for name in free.split(",") if name.strip()]
    given = {"tolerance": tolerance, "free": names, "footprint": footprint, "nseg": nseg}
    defaults = tables()["plan_vehicle"]()
    settings = chosen(defaults | {"turn_max": None}, config, "plan_vehicle", {**limits, **given})
    if settings["turn_max"] is None:
        settings["turn_max"] = defaults["turn_max"] if settings["nseg"] is None else math.pi
    bounds = _checked(settings)
    model, parameters = _about(vehicle, wheelbase, laser)
    wanted = amounts(str(settings["tolerance"]), parameters | {"steering_offset": 0.0}, "--tolerance")
    sigmas = {name: value / interval_factor(0.95, None, 1) for name, value in wanted.items()}
    also, segments = tuple(map(str, cast(list[str], settings["free"]))), settings["nseg"]
    corners = _floor(floor)
    with Run("plan", "plan vehicle", output, settings={"plan_vehicle": settings}) as run:
        run.inputs["vehicle"] = vehicle
        try:
            if segments is not None:
                plan, times = thesis_grid(
                    model, parameters, sigmas, int(str(segments)), bounds["turn_max"], free=also, **bounds
                )
                words = f"drive the grid {times:.2f} times for the tolerances"
            else:
                front, rear, side = _numbers(str(settings["footprint"]) or "0,0,0", 3, "--footprint")
                outline = (front, rear, side)
                plan = plan_vehicle(
                    model,
                    parameters,
                    sigmas,
                    free=also,
                    floor=corners,
                    footprint=outline,
                    token=run.token,
                    **bounds,
                )
                words = f"no plan of such arcs takes less than {plan.bound:.0f} s"
        except ValueError as error:
            raise UserError(str(error)) from error
        plan_vehicle_into(run, plan, corners, words)


def _about(file: Path | None, wheelbase: float | None, laser: str) -> tuple[str, dict[str, float]]:
    if file is not None:
        known = read_vehicle(file_in(file, "vehicle.toml", "vehicle"))
        return known.model, dict(known.parameters)
    if wheelbase is None or not math.isfinite(wheelbase) or wheelbase == 0.0:
        raise UserError("say which vehicle: --vehicle FILE, or --wheelbase METRES of a tricycle")
    x, y, yaw = _numbers(laser, 3, "--laser")
    names = ("drive_scale", "wheelbase", "steering_gain", "laser_x", "laser_y", "laser_yaw")
    return "tricycle", dict(zip(names, (1.0, wheelbase, 1.0, x, y, math.radians(yaw)), strict=True))


def _limits(
    alpha_min: float | None,
    alpha_max: float | None,
    beta_max: float | None,
    path_max: float | None,
    speed: float | None,
    acceleration_max: float | None,
    overhead: float | None,
) -> dict[str, float | None]:
    """Return what was given, in radians."""
    angles = {"angle_min": alpha_min, "angle_max": alpha_max, "turn_max": beta_max}
    return {
        **{name: None if value is None else math.radians(value) for name, value in angles.items()},
        "path_max": path_max,
        "speed": speed,
        "acceleration_max": acceleration_max,
        "overhead": overhead,
    }


def _checked(settings: Settings) -> PlanLimits:
    """Return the limits among the settings."""
    limits = {name: settings[name] for name in plan_limits()}
    for name, value in limits.items():
        good = isinstance(value, int | float) and math.isfinite(value) and (value > 0.0 or name == "overhead")
        if not good:
            raise UserError(f"limit {name.replace('_', ' ')}: must be above 0")
    found = cast(PlanLimits, limits)
    if found["angle_max"] < found["angle_min"]:
        raise UserError("--alpha-max must not be below --alpha-min")
    return found


def _floor(text: str) -> Array | None:
    if not text:
        return None
    path = Path(text)
    try:
        lines = path.read_text("utf-8").splitlines() if path.is_file() else text.split()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"--floor {text}: cannot be read ({error})") from error
    rows = [line for line in lines if line.strip() and not line.startswith("#")]
    return np.array([_numbers(row, 2, f"--floor, corner {k}") for k, row in enumerate(rows, start=1)])


def _numbers(text: str, count: int, name: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        raise UserError(f"{name} {text!r}: must be {count} numbers with commas between")
    return numbers

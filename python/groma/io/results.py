"""The folder that a run leaves: `results/<stamp>/` with `results/latest` pointing to it, or the one given with -o.

What is written depends on the result, the settings and the input alone: no time of day, no place on the disk, no random
name. So the same input, settings and version give the same bytes.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shlex
from collections.abc import Iterable, Mapping
from datetime import datetime
from pathlib import Path

import numpy as np

import groma
from groma.errors import UserError
from groma.io.atomic import write_text
from groma.io.g2o import Graph, write_g2o
from groma.io.landmarks import write_landmarks
from groma.io.nav2_map import write_map
from groma.io.toml import to_toml
from groma.io.trajectory import Trajectory, write_tum
from groma.mapping import MapResult, PoseGraph
from groma.report.figures import map_figures
from groma.report.map_report import map_report
from groma.survey import Surveyed

ROOT = Path("results")


def result_directory(output: Path | None, now: datetime) -> Path:
    """Make the folder for a run and return it; call it before the work, so that a mistake shows at once.

    Parameters
    ----------
    output
        What the user asked for; it may exist, its files are then replaced. None: a new folder in `results`.
    now
        Names the new folder.

    Raises
    ------
    UserError
        When there is a file in its place or it cannot be written to.
    """
    directory = output if output is not None else _free(ROOT / now.strftime("%Y-%m-%dT%H-%M-%S"))
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise UserError(f"{directory}: is a file, not a folder: choose another with -o") from error
    except OSError as error:
        raise UserError(f"{directory}: cannot be made ({error.strerror}): choose another with -o") from error
    if not os.access(directory, os.W_OK | os.X_OK):
        raise UserError(f"{directory}: cannot be written to: choose another with -o")
    return directory


def point_latest(directory: Path) -> None:
    """Let `latest` beside a folder point to it; where links need rights (Windows), a file holds its name instead."""
    link, beside = directory.parent / "latest", directory.parent / f".latest.{directory.name}"
    try:
        beside.symlink_to(directory.name, target_is_directory=True)
        os.replace(beside, link)
    except OSError:
        beside.unlink(missing_ok=True)
        write_text(directory.parent / "latest.txt", f"{directory.name}\n")


def save_map(
    result: MapResult,
    settings: Mapping[str, object],
    source: Path | None,
    directory: Path,
    command: str | None = None,
) -> None:
    """Write all files of a map; the report comes last, so that it is there only when all are.

    Parameters
    ----------
    result
        The map.
    settings
        Every setting by name, tables nested.
    source
        The recording, a file or a folder; None when there is none.
    directory
        Exists.
    command
        The command line, without what does not bear on the result (-o, threads).

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    run = run_record(settings, source, command)
    write_tum(directory / "trajectory.tum", result.trajectory_stamps, result.trajectory)
    write_g2o(directory / "graph.g2o", to_g2o(result.graph))
    write_map(directory / "map.yaml", result.grid)
    write_landmarks(directory / "landmarks.json", result.landmarks)
    write_text(directory / "metrics.json", json.dumps(map_figures(result), indent=1, sort_keys=True) + "\n")
    write_text(directory / "run.toml", to_toml(run))
    write_text(directory / "report.html", map_report(result, run))


def save_survey(result: Surveyed, trajectory: Trajectory, run: Mapping[str, object], directory: Path) -> None:
    """Write the files of a map at known poses.

    Raises
    ------
    UserError
        When a file cannot be written; none is left half.
    """
    write_tum(directory / "trajectory.tum", trajectory.stamps, trajectory.poses)
    write_map(directory / "map.yaml", result.grid)
    write_landmarks(directory / "landmarks.json", result.landmarks)
    write_text(directory / "metrics.json", json.dumps({"counts": result.counts}, indent=1, sort_keys=True) + "\n")
    write_text(directory / "run.toml", to_toml(run))


def run_record(settings: Mapping[str, object], source: Path | None, command: str | None) -> dict[str, object]:
    """Return what made a result: versions, input and settings."""
    return {
        "groma": groma.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "command": command,
        "input": None if source is None else _fingerprint(source),
        "settings": settings,
    }


def to_g2o(graph: PoseGraph) -> Graph:
    """Return the graph with its nodes numbered from 0 and the first one fixed."""
    ids = np.arange(len(graph.poses))
    return Graph(ids, graph.poses, graph.pairs, graph.measurements, graph.information, (0,) if len(ids) else ())


def _free(directory: Path) -> Path:
    """Return the directory, or the first one with a number behind that does not exist."""
    choices = (directory.with_name(f"{directory.name}-{i}") for i in range(2, 10_000))
    return directory if not directory.exists() else next(choice for choice in choices if not choice.exists())


def _fingerprint(source: Path) -> dict[str, object]:
    """Return name, size and SHA-256 of a file; of a folder, those over its files in the order of their names."""
    name = source.resolve().name.encode(errors="replace").decode()
    if source.is_dir():
        files = sorted(path for path in source.rglob("*") if path.is_file())
        return {"name": name, "files": {str(path.relative_to(source)): _fingerprint(path) for path in files}}
    with source.open("rb") as file:
        return {"name": name, "bytes": source.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}


def shown_command(arguments: Iterable[str]) -> str:
    """Return a command line as it is recorded: without the options that choose a place or a number of threads."""
    kept: list[str] = []
    silent = False
    for argument in arguments:
        name = argument.partition("=")[0]
        silenced = silent or name in _WITHOUT_EFFECT
        silent = not silent and argument in _WITHOUT_EFFECT
        if not silenced:
            kept.append(argument)
    return shlex.join(["groma", *kept])


_WITHOUT_EFFECT = {"-o", "--output", "--threads"}

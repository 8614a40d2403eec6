"""`groma demo`: what groma does, one chapter each, on simulated recordings, so that the truth is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from groma.cli.demo_cameras import map_simulated_cameras
from groma.cli.demo_localization import localize_simulated
from groma.cli.demo_map import map_simulated
from groma.cli.demo_plan import PLANS, plan_simulated
from groma.cli.demo_vehicle import calibrate_simulated
from groma.report.findings import findings_section
from groma.report.outcome import Outcome
from groma.report.page import Html, page, section, text
from groma.runs.run import Run

SEED = 1


@dataclass(frozen=True, slots=True)
class Chapter:
    """One thing that groma does."""

    title: str
    folder: str
    command: str
    """What a user types for a recording of his own."""
    run: Callable[[Run, Path, int], tuple[object, list[str]]]
    """Takes the run, a folder for recordings and a seed; returns lines for a person last."""
    pages: tuple[str, ...] = ("report.html",)
    """Its reports, in the folder."""


CHAPTERS = (
    Chapter("Calibrate a vehicle", "vehicle", "groma calibrate vehicle FILE", calibrate_simulated),
    Chapter("Map a building", "map", "groma map FILE", map_simulated),
    Chapter("Localize in it", "localization", "groma localize FILE --map DIR --vehicle FILE", localize_simulated),
    Chapter("Map its cameras", "cameras", "groma cameras map DIR", map_simulated_cameras),
    Chapter("Plan where to drive", "plan", "groma plan exploration GRAPH", plan_simulated, PLANS),
)


def demo(*, output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None) -> None:
    """Run groma on simulated recordings and compare each result with the ground truth: the first command to try.

    groma demo

    groma demo -o demo

    Parameters
    ----------
    output
        Folder for the recordings and the results; a new one in results/ when left out.
    """
    with Run("evaluation", "demo", output, settings={"demo": {"seed": SEED}}) as run:
        told = [_show(chapter, run) for chapter in CHAPTERS]
        pages = {f"{chapter.title}": lines for chapter, lines in zip(CHAPTERS, told, strict=True)}
        run.finish({"chapters": pages}, "What groma does", lambda outcome: _contents(told, outcome))
    print("for a recording of your own: groma inspect FILE")


def _show(chapter: Chapter, run: Run) -> list[str]:
    """Run a chapter in a folder of its own and print what it says."""
    print(f"{chapter.title} ({chapter.command})", flush=True)
    _, lines = chapter.run(run, run.path("recordings/of").parent, SEED)
    for line in lines:
        print(f"  {line}", flush=True)
    return lines


def _contents(told: list[list[str]], outcome: Outcome) -> str:
    """Return a page that leads to the reports."""
    head = text("p", f"Simulated recordings, seed {SEED}: every result is compared with the ground truth.")
    parts = (_entry(chapter, lines) for chapter, lines in zip(CHAPTERS, told, strict=True))
    return page("groma demo", [text("h1", outcome.headline), head, *parts, findings_section(outcome.findings)])


def _entry(chapter: Chapter, lines: list[str]) -> Html:
    links = (
        Html(f'<p><a href="{chapter.folder}/{name}">{escape(chapter.folder)}/{escape(name)}</a></p>')
        for name in chapter.pages
    )
    return section(chapter.title, *(text("p", line.strip()) for line in lines), text("pre", chapter.command), *links)

"""Every numeric field of every format set to NaN, +-inf, +-1e300, 0 and -1: no command hangs, breaks or eats memory."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hostile import bags, formats, link
from hostile.changes import changes
from hostile.formats import FORMATS, Format

SHARE = 150
"""The quick run takes one case of so many."""
MOST_SECONDS, MOST_MEGABYTES = 20.0, 1300.0
"""Of a command; 300 MB are those of the program itself."""
PRELOAD = ("groma.cli", "numpy", "msgspec", "groma.io.recording", "groma.mapping.mapper")


@dataclass
class Runner:
    """Runs command lines under bounds; see runner.py."""

    process: subprocess.Popen[str]
    folder: Path
    runs: int = 0

    def complaint(self, arguments: list[str], folder: Path, program: str = "groma.cli") -> str:
        """Run a command in a folder; return what is wrong with how it ended, nothing when all is well."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        request = {"program": program, "arguments": arguments, "folder": str(folder)}
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        found: dict[str, Any] = json.loads(self.process.stdout.readline())
        self.runs += 1
        wrong = [
            f"exit code {found['code']}" if found["code"] not in (0, 1, 2) else "",
            "a traceback" if "Traceback" in found["said"] else "",
            "a panic" if "panicked" in found["said"] else "",
            f"{found['seconds']:.0f} s" if found["seconds"] > MOST_SECONDS else "",
            f"{found['megabytes']:.0f} MB" if found["megabytes"] > MOST_MEGABYTES else "",
        ]
        told = ", ".join(filter(None, wrong))
        return f"{told}: {found['said'].strip()[-300:]}" if told else ""

    def place(self) -> Path:
        """An empty folder for the next case."""
        shutil.rmtree(self.folder / "case", ignore_errors=True)
        (self.folder / "case").mkdir()
        return self.folder / "case"


@pytest.fixture(scope="module")
def runner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Runner]:
    command = [sys.executable, str(Path(__file__).with_name("runner.py")), *PRELOAD]
    alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # a fork takes no threads along
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=alone) as process:
        yield Runner(process, tmp_path_factory.mktemp("hostile"))
        assert process.stdin is not None
        process.stdin.close()


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The good files."""
    folder = tmp_path_factory.mktemp("good")
    formats.make(folder)
    return folder


def chosen(kind: str, name: str, *, whole: bool) -> bool:
    """Whether a case is run: all of them, or a share that is the same on every machine."""
    return whole or zlib.crc32(f"{kind} {name}".encode()) % SHARE == 0


def beside(good: Path, file: str, case: Path) -> Path:
    """Link what lies beside a file of the good folder into the folder of a case; return where the file goes."""
    top = Path(file).parts[0]
    if (good / top).is_file():
        return case / file
    shutil.copytree(good / top, case / top, copy_function=lambda a, b: Path(b).symlink_to(a))
    (case / file).unlink()
    return case / file


def complaints_of_text(kind: Format, good: Path, runner: Runner, *, whole: bool) -> list[str]:
    """Run the chosen changes of a text format; return what went wrong."""
    text = (good / kind.file).read_text()
    found = []
    for change in changes(text, kind.spelling, kind.lines(text)):
        if not chosen(kind.name, change.name, whole=whole):
            continue
        case = runner.place()
        file = beside(good, kind.file, case)
        file.write_text(change.text)
        names = {"{file}": str(file), "{folder}": str(file.parent), "{good}": str(good)}
        arguments = [names.get(word, word.replace("{good}", str(good))) for word in kind.command]
        if told := runner.complaint(arguments, case, kind.program):
            found.append(f"{change.name}: {told}")
    return found


def complaints_of_bag(kind: bags.Bag, runner: Runner, *, whole: bool) -> list[str]:
    """Run the chosen changes of a bag."""
    found = []
    for change in bags.changes():
        if not chosen(kind.name, change.name, whole=whole):
            continue
        case = runner.place()
        file = kind.write(case, change)
        if file is not None and (told := runner.complaint([*kind.command, str(file)], case)):
            found.append(f"{change.name}: {told}")
    return found


@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.name)
def test_a_few_numbers_of_a_text(kind: Format, good: Path, runner: Runner) -> None:
    assert complaints_of_text(kind, good, runner, whole=False) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS, ids=lambda kind: kind.name)
def test_every_number_of_a_text(kind: Format, good: Path, runner: Runner) -> None:
    assert complaints_of_text(kind, good, runner, whole=True) == []


@pytest.mark.parametrize("kind", bags.KINDS, ids=lambda kind: kind.name)
def test_a_few_numbers_of_a_bag(kind: bags.Bag, runner: Runner) -> None:
    assert complaints_of_bag(kind, runner, whole=False) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", bags.KINDS, ids=lambda kind: kind.name)
def test_every_number_of_a_bag(kind: bags.Bag, runner: Runner) -> None:
    assert complaints_of_bag(kind, runner, whole=True) == []


def complaints_of_link(good: Path, runner: Runner, *, whole: bool) -> list[str]:
    """Run the chosen changes of what a live survey recorded."""
    told, found = link.messages(good / "survey"), []
    for number, change in link.cases(told):
        name = f"message {number}, {change.name}"
        if not chosen("link", name, whole=whole):
            continue
        case = runner.place()
        beside(good, "survey/detections.jsonl", case)
        (case / "survey" / "odometry.csv").unlink()
        link.write(case / "survey" / "recording.mcap", told, number, change.text)
        if complaint := runner.complaint(["cameras", "map", str(case / "survey"), "-o", "out"], case):
            found.append(f"{name}: {complaint}")
    return found


def test_a_live_survey_that_is_not_changed_gives_a_map(good: Path, runner: Runner) -> None:
    case = runner.place()
    beside(good, "survey/detections.jsonl", case)
    (case / "survey" / "odometry.csv").unlink()
    link.write(case / "survey" / "recording.mcap", link.messages(good / "survey"))
    assert runner.complaint(["cameras", "map", str(case / "survey"), "-o", "out"], case) == ""
    assert (case / "out" / "network.json").exists()


def test_a_few_numbers_of_a_live_survey(good: Path, runner: Runner) -> None:
    assert complaints_of_link(good, runner, whole=False) == []


@pytest.mark.slow
def test_every_number_of_a_live_survey(good: Path, runner: Runner) -> None:
    assert complaints_of_link(good, runner, whole=True) == []

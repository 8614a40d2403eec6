"""The examples: each runs as it is, without a warning, and reaches the bound that its head states."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
PROMISE = re.compile(r"The last line is the (?P<what>[^,]+), below (?P<bound>[\d.]+) (?P<unit>\w+)\.$")
LINES_MAX = 50


def test_examples_are_numbered_without_a_gap() -> None:
    assert [path.name[:3] for path in EXAMPLES] == [f"0{k}_" for k in range(1, 8)]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_reaches_the_bound_of_its_head(example: Path, tmp_path: Path) -> None:
    text = example.read_text("utf-8")
    promise = PROMISE.search(ast.get_docstring(ast.parse(text)) or "")
    assert promise, f"{example.name}: its head must end in the line that says what the last line printed is"
    assert len(text.splitlines()) <= LINES_MAX, f"{example.name} does not fit a screen"
    environment = os.environ | {"PYTHONWARNINGS": "error", "PYTHONIOENCODING": "utf-8"}
    run = subprocess.run(
        [sys.executable, example], cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8", timeout=300
    )
    assert (run.returncode, run.stderr) == (0, "")
    last = run.stdout.splitlines()[-1]
    what, value = re.escape(promise["what"]), r"(\d+(?:\.\d+)?)"
    printed = re.fullmatch(rf"{what}: {value} {promise['unit']}", last)
    assert printed, f"{last!r} is not the {promise['what']}"
    assert float(printed[1]) < float(promise["bound"])

"""Every example in the docstrings of the package runs and shows what it says.

Numbers are compared as numbers, to a unit of the last digit that the example shows, and blanks do not count: the sign
of zero and the last bits differ from machine to machine.
"""

from __future__ import annotations

import doctest
import importlib
import math
import re
from pathlib import Path

import pytest

import groma

ROOT = Path(groma.__file__).parent
MODULES = sorted(
    ".".join(["groma", *path.relative_to(ROOT).with_suffix("").parts])
    for path in ROOT.rglob("*.py")
    if ">>>" in path.read_text(encoding="utf-8")
)


NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?![\w.])")
PLACES = 8
"""That numpy shows: `0.` represents a number without more of them."""


class Numbers(doctest.OutputChecker):
    """Compares text as text and numbers as numbers."""

    def check_output(self, want: str, got: str, optionflags: int) -> bool:
        """Return whether an example shows what it says."""
        if super().check_output(want, got, optionflags):
            return True
        wanted, found = NUMBER.findall(want), NUMBER.findall(got)
        same_text = _squeezed(want) == _squeezed(got) and len(wanted) == len(found)
        return same_text and all(map(_agree, wanted, found))


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", "", NUMBER.sub("#", text))


def _agree(wanted: str, found: str) -> bool:
    if "." not in wanted:
        return wanted == found
    mantissa, _, exponent = wanted.partition("e")
    digits = len(mantissa.partition(".")[2]) or PLACES
    unit = 10.0 ** (int(exponent or 0) - digits)
    return math.isclose(float(wanted), float(found), rel_tol=0.0, abs_tol=1.001 * unit)


@pytest.mark.parametrize("module", MODULES)
def test_examples(module: str) -> None:
    runner = doctest.DocTestRunner(checker=Numbers())
    for example in doctest.DocTestFinder().find(importlib.import_module(module)):
        runner.run(example)
    assert runner.summarize(verbose=False).attempted > 0
    assert runner.summarize(verbose=False).failed == 0


@pytest.mark.parametrize(
    ("want", "got", "agree"),
    [
        ("([1.0, 0.5, 0.0], 5)", "([1.0, 0.5, -0.0], 5)", True),
        ("array([0.2024, 0.    ])", "array([ 0.2024, -0.    ])", True),
        ("0.0995", "0.0996", True),
        ("0.0995", "0.0998", False),
        ("-1.5", "1.5", False),
        ("5", "6", False),
        ("[1.0]", "[1.0, 2.0]", False),
        ("1.0 m", "1.0 s", False),
    ],
)
def test_examples_are_compared_as_numbers(want: str, got: str, agree: bool) -> None:
    assert Numbers().check_output(want, got, 0) is agree

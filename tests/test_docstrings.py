"""Every example in the docstrings of the package runs."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import groma

ROOT = Path(groma.__file__).parent
MODULES = sorted(
    ".".join(["groma", *path.relative_to(ROOT).with_suffix("").parts])
    for path in ROOT.rglob("*.py")
    if ">>>" in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("module", MODULES)
def test_examples(module: str) -> None:
    result = doctest.testmod(importlib.import_module(module))
    assert result.attempted > 0
    assert result.failed == 0

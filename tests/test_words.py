"""The word list finds what it should, in the place where it is, and nothing in plain sentences."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts" / "words.py"
WORDS = runpy.run_path(str(SCRIPT))

BAD = [
    "each result held against the truth",
    "what a pose is worth",
    "The drive star knows the worst pixel best",
    "171 motions tell the differential drive and where the laser sits",
    "Known worst in combination: fx with fy with k1",
    "a corner found on the way",
    "0.1 % of the way driven",
    "the map is weakly held by walls",
    "plans as accurate as asked for",
    "what the drive leaves open",
    "g and h stand for points fitted with the wrong arm",
    "how far a covariance is to be believed",
    "intervals that are honest",
    "drives that people use",
    "1 cm a metre",
]
GOOD = [
    "each result compared with the ground truth",
    "The star trajectory gives the lowest worst-pixel error.",
    "A 232 m drive locates all 16 cameras to 24 cm (1 sigma).",
    "held-out views, the bound holds for all n, a way to the door, one a priori estimate",
    "fx, fy and k1 are strongly correlated. This is worth reading.",
]


def found(text: str, suffix: str) -> list[Any]:
    return list(WORDS["search"](text, suffix))


@pytest.mark.parametrize("sentence", BAD)
def test_private_words_are_found_in_all_kinds_of_files(sentence: str) -> None:
    assert found(sentence, ".md")
    assert found(f'"""{sentence}."""\n', ".py")
    assert found(f'print(f"{{1}} {sentence}")  # plain\n', ".py")
    assert found(f"/// {sentence}\nfn short() {{}}\n", ".rs")
    assert found(f'let text = "{sentence}";\n', ".rs")


@pytest.mark.parametrize("sentence", GOOD)
def test_plain_words_pass(sentence: str) -> None:
    assert not found(sentence, ".md")
    assert not found(f"# {sentence}\n", ".py")
    assert not found(f"// {sentence}\n", ".rs")


def test_words_that_are_only_overused_are_found_in_documents_only() -> None:
    assert found("The report tells it.", ".md")
    assert not found("# The report tells it.\n", ".py")


def test_a_phrase_is_found_over_the_end_of_a_line_and_named_with_its_first() -> None:
    assert [hit.line for hit in found("One.\nIt is held\nagainst a closed form.", ".md")][:1] == [2]
    assert [hit.line for hit in found('x = 1\n"""It is held\n    against it."""\n', ".py")] == [2]
    assert [hit.line for hit in found("//! It is held\n//! against it.\n", ".rs")] == [1]
    assert [hit.line for hit in found('f("It is held "\n  "against it.")\n', ".py")] == [1]


def test_code_is_not_read_but_names_of_tests_are() -> None:
    assert not found("Take `held against` from:\n\n```text\nheld against\n```\n", ".md")
    assert not found("held_against = 1\n", ".py")
    assert found("def test_it_is_held_against_it() -> None: ...\n", ".py")
    assert not found("let held_against = 1;\n", ".rs")
    assert found("#[test]\nfn it_is_held_against_it() {}\n", ".rs")


def test_every_pattern_says_what_to_write() -> None:
    for pattern, instead in {**WORDS["EVERYWHERE"], **WORDS["STRICT"]}.items():
        assert len(instead) > 1, pattern
        assert not found(instead, ".md"), instead


def test_the_script_names_the_line_and_fails(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("Plain.\nWhat a pose is worth.\n")
    done = subprocess.run([sys.executable, str(SCRIPT), str(page)], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert f'{page}:2: "What a pose is worth": write pose quality, accuracy\n' in done.stdout


def test_the_project_passes() -> None:
    done = subprocess.run([sys.executable, str(SCRIPT)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout

"""Good files with one number replaced.

A text is cut at its numbers. Of a text log one line of each kind is taken, of its long runs of readings some; of all
other files every number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")
VALUES = {
    "plain": ("nan", "inf", "-inf", "1e300", "-1e300", "0", "-1"),
    "yaml": (".nan", ".inf", "-.inf", "1.0e+300", "-1.0e+300", "0", "-1"),
    "json": ("NaN", "Infinity", "-Infinity", "1e300", "-1e300", "0", "-1"),
}
"""How a format writes what no field should hold."""
RUN = 24
"""Of a line with more numbers than this, those at both ends and two in the middle are taken."""


@dataclass(frozen=True)
class Change:
    """One number of a text, replaced."""

    line: int
    """From 1."""
    number: int
    """Which number of the line, from 1."""
    value: str
    text: str
    """The whole text, changed."""

    @property
    def name(self) -> str:
        """Where and what."""
        return f"line {self.line}, number {self.number}: {self.value}"


def changes(text: str, spelling: str, lines: Sequence[int]) -> Iterator[Change]:
    """Yield every change of the lines (from 1)."""
    rows = text.splitlines(keepends=True)
    for line in lines:
        row = rows[line - 1]
        found = list(NUMBER.finditer(row))
        for number in taken(len(found)):
            begin, end = found[number].span()
            for value in VALUES[spelling]:
                if value != row[begin:end]:
                    changed = row[:begin] + value + row[end:]
                    yield Change(line, number + 1, value, "".join([*rows[: line - 1], changed, *rows[line:]]))


def taken(count: int) -> list[int]:
    """Which of so many numbers are changed."""
    if count <= RUN:
        return list(range(count))
    return sorted({*range(RUN // 2), count // 2, count // 2 + 1, *range(count - RUN // 2, count)})


def lines_of_each_kind(text: str, separator: str | None) -> list[int]:
    """Return one line of each first word: the middle one."""
    kinds: dict[str, list[int]] = {}
    for number, row in enumerate(text.splitlines(), 1):
        word = row.split(separator, 1)[0].strip() if row.strip() else ""
        if word and not row.startswith("# "):
            kinds.setdefault(word if not NUMBER.fullmatch(word) else "", []).append(number)
    return sorted(numbers[len(numbers) // 2] for numbers in kinds.values())


def all_lines(text: str) -> list[int]:
    """Return every line."""
    return list(range(1, len(text.splitlines()) + 1))


def lines_of_table(text: str, table: str) -> list[int]:
    """Return the lines of a table of a TOML text and of the tables in it."""
    inside, lines = False, []
    for number, row in enumerate(text.splitlines(), 1):
        if row.startswith("["):
            inside = row.strip("[] \n").split(".")[0] == table
        elif inside:
            lines.append(number)
    return lines

"""Writes docs/reference/cli.md from the help of the commands; `make docs` runs it, a test compares.

Lines of help that begin with `groma` are examples: they become blocks of `sh`, which `tests/test_docs.py` runs.
"""

from __future__ import annotations

import re
from pathlib import Path

from groma.cli import app

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "cli.md"

HEAD = """# Commands

Written by `make docs` from the help of the commands (`groma COMMAND --help`); do not edit.

Exit codes: 0 done, 1 there is no estimate or it must not be relied on, 2 a mistake in the request or the input, told in
one line, 130 interrupted before there was a result. Results go to standard output or to files
([what every run leaves](runs.md)), [findings](findings.md) and progress to standard error; progress only to a terminal.

"""


def page() -> str:
    """Return the page."""
    text = app.generate_docs(output_format="markdown", flatten_commands=True)
    sections = re.split(r"^(?=# groma )", text, flags=re.MULTILINE)[1:]
    return HEAD + "\n".join(_section(section) for section in sorted(sections)).rstrip() + "\n"


def _section(text: str) -> str:
    body = re.sub(r"^# ", "## ", text.strip(), flags=re.MULTILINE)
    examples = re.sub(r"(?<=\n\n)((?:groma [^\n]+\n\n)+)", _block, body + "\n\n")
    return examples.replace(" *[default: False]*", "").rstrip() + "\n"


def _block(found: re.Match[str]) -> str:
    lines = found[1].replace("\n\n", "\n")
    return f"```sh\n{lines}```\n\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

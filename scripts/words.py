"""The word list: finds words that only this project uses, and says what to write instead.

    python scripts/words.py [FILE ...]     the given files, or all files of the project

A line of output names file and line, the words found, and what to write. Exit code 1 if there is one.

Markdown is read without its code (fences and backquotes). Of Python and Rust only what people read is searched:
docstrings, comments, strings, and names of tests. A blank in a pattern matches any white space, so that a phrase is
found across the end of a line.

``STRICT`` lists words that have a plain use too, but that our documents overuse: they are not allowed in Markdown.
``EVERYWHERE`` lists words that are not allowed in any file.
"""

from __future__ import annotations

import io
import re
import sys
import tokenize
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]

EVERYWHERE = {
    r"held against": "compared with, checked against",
    r"against the truth": "against the ground truth",
    r"(is|are|be|was) worth(?! (it|its|know|read|remember|do|driv|a |the ))": "name it: accuracy, weight, value",
    r"what (a|the) \w+ (is|are) worth": "pose quality, accuracy",
    r"knows? (\w+ )?(\w+ )?(\w+ )?best": "has the lowest uncertainty",
    r"known (worst|best)|worst known": "strongly correlated; least (most) accurate",
    r"people use": "common",
    r"motions? tells?": "calibrated from n motions; the motion determines",
    r"tells? (how|where|which) (far|good|well) ": "reports, gives",
    r"tells? (no|nothing|nobody)": "does not determine, does not report",
    r"tells? of (it|its|the|them|themselves|what)": "describes, reports",
    r"(cannot|can|could) be told": "can(not) be determined, can(not) be distinguished",
    r"(told|tell|tells|telling) apart": "distinguish",
    r"(be|are|is|was|were) told (by|in|on|of|from|that|what|to|how)": "given, reported, passed",
    r"says? of (itself|themselves|its|the|what|each|one|a)": "reports about, describes",
    r"spoken for": "assigned",
    r"speaks? (for|against)": "supports, contradicts",
    r"(its|their|the) say when": "its weight when",
    r"asked for|(when|as|unless|only when) (it is |they are )?asked": "required, requested; on request, as required",
    r"(may|can|could) be asked": "can be queried, can be requested",
    r"wanted (accuracy|sigma|width|precision|variance)": "required accuracy",
    r"what is wanted": "what is required",
    r"stands? for": "represents, models, means",
    r"stands? in (the |its )?(docs|head|heads|file|commit|metrics|report)": "is in",
    r"as (it|they) stands?(?! still)": "as is",
    r"stands? across": "constrains this direction",
    r"let(s)? what lasts": "promote landmarks",
    r"what lasts": "persistent landmarks",
    r"what is left of": "residual of, remainder of",
    r"what is open|what (the|a) drive leaves open": "undetermined parameters",
    r"leaves? (something|nothing|it|one|all|a \w+|parameters) open": "does not determine",
    r"(weakly|loosely|well|not|nothing|badly) held(?! by the client)": "weakly (well, not) constrained",
    r"nothing holds|holds the (pose|map|position|robot|vehicle|direction|scan)": "constrains the pose",
    r"held by (walls|landmarks|the|scans|odometry|nothing)": "constrained by",
    r"(of|by|the) (the )?(longest |whole )?way (driven|back|since|between|that was)": "distance driven",
    r"(of|a|per) (metre|m|root metre) of (its |the )?way|m of way|\d m way|metre of way": "distance driven",
    r"of way": "of distance",
    r"found on the way": "found during the drive",
    r"(an?|with|how|is|are|as|more|less|its|their|the) honest(?!ly)|honesty": "consistent, calibrated",
    r"may it be believed|to be believed|how far to believe|may be believed": "trustworthy, accepted, how accurate",
    r"is believed": "is assumed, is used, is accepted",
    r"taken to be": "assumed to be",
    r"given out": "reported, published",
    r"hangs? on|hang on": "depends on",
    r"of late": "recently",
    r"set right": "corrected",
    r"mend(s|ed|ing)?": "fix, correct, repair",
    r"made white": "whitened",
    r"(a|one|every|each|the) looks?(?! at| like| up| for| ahead| into)": "view, observation",
    r"(the )?unseen": "never observed, unobserved",
    r"seen plain": "observed",
    r"(the|this|whole|our) house\b|house stands|today's house": "code base, project",
    r"the room it belongs to|which room": "module, crate",
    r"what lies where": "layout",
    r"who creeps|whoever|he who": "a robot that creeps; users of",
    r"its kin": "similar tools",
    r"errs|err again": "is wrong, has the same error again",
    r"sights? (that|of the|beyond)": "observations",
    r"fall(s)? together": "coincide",
    r"beyond use": "useless, too uncertain to use",
    r"can be had": "is available",
    r"trade what|what (strategies|they) trade": "trade-off",
    r"by how far|how far it is to be trusted": "by how much",
    r"(metres?|cm|mm|degrees?|px|m) a (metre|second|minute|cell|scan|step|stop|root metre)": "per metre, per second",
    r"(one|once|two|file|thread|process|line|panel|curve|dot) a (cell|core|run|row|line|component|day|look)": "per",
    r"(one|once|line|file|rows|panel|curve) a (file|parameter|pairing|report|scan|stop|camera|neighbourhood)": "per",
}
"""Patterns that are allowed in no file, with what to write instead."""

STRICT = {
    r"tells?|told|telling": "reports, says, states, gives, determines, shows",
    r"(?<!hand-)held(?![ -]out)": "kept, constrained, compared",
    r"holds?(?! (for|if|when|in|with|at|whatever|only|under|here|to first|exactly)|[.,;:)])": "contains, keeps",
    r"asks?|asked|asking": "require, request, query",
    r"anew": "again",
    r"alike": "equal, the same, equally",
    r"beside(?! the checkout)": "next to, with, besides",
    r"stands?(?! still| out| between|still)": "is, is in",
    r"standing in": "in",
    r"beliefs?|believe[sd]?": "assume, accept, estimate",
    r"honest(ly|y)?": "consistent, calibrated, unbiased",
    r"lies? (beside|where|what|in the|under)|lie (beside|in)": "is next to, is in",
    r"goes on|go on|gone on": "continues",
    r"(the|its|their|whole|that|this) way(?! (to|that|of|in|round|as|than)|[.,;])": "distance, path",
    r"on the way(?! to)": "during the drive, between",
    r", for (it|they|there|he|this is|that is)": ", because",
    r"odd(?! (number|index|count))": "unusual, inconsistent",
    r"serves?(?! as)": "works, is used, is for",
    r"wanted": "required, requested",
    r"of itself|of themselves": "about itself",
    r"nothing but": "only",
    r"thereby|whence|wherein|lest|unto|thus far|hence": "so, therefore",
    r"so long as": "while, if",
    r"turned down": "rejected",
    r"passed over": "skipped",
    r"come out": "result",
}
"""Patterns that are not allowed in Markdown, with what to write instead."""

FOLDERS = (
    *((folder, "py") for folder in ("python", "tests", "benches", "examples", "scripts")),
    ("python", "pyi"),
    ("crates", "rs"),
)
ABOUT = ("scripts/words.py", "tests/test_words.py")
"""Files that name the words themselves."""

GENERATED = ("docs/reference/cli.md", "docs/reference/findings.md")
"""Pages that scripts write from the code: words that are only overused are allowed there, as in the code."""


class Found(NamedTuple):
    """A place where the list says no."""

    line: int
    words: str
    instead: str


def compiled(patterns: dict[str, str]) -> list[tuple[re.Pattern[str], str]]:
    """Return the patterns as whole words in any case, a blank as any white space."""
    return [(re.compile(rf"\b(?:{key})\b".replace(" ", r"\s+"), re.IGNORECASE), text) for key, text in patterns.items()]


def markdown(text: str) -> str:
    """Return a text of equal length without its code: fences, backquotes, addresses of links."""
    code = re.compile(r"^```.*?^```|`[^`\n]*`|(?<=\])\([^)\s]*\)", re.MULTILINE | re.DOTALL)
    return code.sub(lambda found: _blank(found[0]), text)


def python(text: str) -> str:
    """Return a text of equal length with docstrings, comments, strings and names of tests only."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    kept = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        begin = starts[token.start[0] - 1] + token.start[1]
        if tokenize.tok_name[token.type] in {"COMMENT", "STRING", "FSTRING_MIDDLE"}:
            kept.append((begin, _prose(token.string)))
        elif token.type == tokenize.NAME and token.string.startswith("test_"):
            kept.append((begin, token.string.replace("_", " ")))
    return _only(text, kept)


def rust(text: str) -> str:
    """Return a text of equal length with comments, strings and names of tests only."""
    kept = []
    for found in re.finditer(r'//[^\n]*|"(?:[^"\\]|\\.)*"|(?<=#\[test\]\n)\s*fn \w+', text, re.DOTALL):
        is_test = found[0].lstrip().startswith("fn ")
        kept.append((found.start(), found[0].replace("_", " ") if is_test else _prose(found[0])))
    return _only(text, kept)


def _prose(token: str) -> str:
    """Return a comment or string without its marks and without code: values in braces, words in backquotes, keys."""
    if re.fullmatch(r'[rbfRBF]*"\S*"', token):
        return _blank(token)
    marks = r'^[rbfRBF]*"+|"+$|^\s*(//[/!]?|#)|\\$|`[^`\n]*`'
    if not token.startswith(("/", "#", '"""')):
        marks += r"|\{[^{}]*\}"
    return re.sub(marks, lambda found: _blank(found[0]), token)


def _only(text: str, kept: Iterable[tuple[int, str]]) -> str:
    """Return a text of equal length that is blank but for some pieces, so that sentences continue over lines."""
    result, last = [], 0
    for begin, piece in kept:
        result += [_wall(text[last:begin]), piece]
        last = begin + len(piece)
    return "".join([*result, _wall(text[last:])])


def _wall(text: str) -> str:
    """Return a text of equal length that no phrase goes through."""
    return re.sub(r"\S", "\0", text)


def _blank(text: str) -> str:
    return re.sub(r"[^\n]", " ", text)


READERS = {".md": markdown, ".py": python, ".pyi": python, ".rs": rust}


def search(text: str, suffix: str, *, strict: bool = True) -> Iterator[Found]:
    """Yield what the list does not allow in the text of a file, in order of lines; strict: `STRICT` in Markdown too."""
    read = READERS[suffix](text)
    patterns = _EVERYWHERE + (_STRICT if strict and suffix == ".md" else [])
    hits = sorted((hit.start(), hit[0], instead) for pattern, instead in patterns for hit in pattern.finditer(read))
    for start, words, instead in hits:
        yield Found(text.count("\n", 0, start) + 1, " ".join(words.split()), instead)


_EVERYWHERE, _STRICT = compiled(EVERYWHERE), compiled(STRICT)


def files() -> list[Path]:
    """Return the files of the project that are searched."""
    roots = ["*.md", "docs/**/*.md", *(f"{folder}/**/*.{end}" for folder, end in FOLDERS)]
    found = {path for pattern in roots for path in ROOT.glob(pattern)}
    return sorted(path for path in found if path.relative_to(ROOT).as_posix() not in ABOUT)


def _name(path: Path) -> Path:
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else path


def main(names: list[str]) -> int:
    """Print what is found; return the exit code."""
    paths = [Path(name).resolve() for name in names] or files()
    lines = [
        f'{_name(path)}:{found.line}: "{found.words}": write {found.instead}'
        for path in paths
        for found in search(path.read_text("utf-8"), path.suffix, strict=_name(path).as_posix() not in GENERATED)
    ]
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

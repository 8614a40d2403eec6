"""A self-contained HTML page: no script, no link, nothing loaded; readable on a phone, on paper, by day and by night.

Text is escaped by the functions that take it; what they return (`Html`) is not escaped again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from typing import NewType

Html = NewType("Html", str)

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def page(title: str, body: Iterable[Html]) -> str:
    """Return a whole page."""
    style = files(__package__).joinpath("page.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(body)
        + "\n</main>\n</body>\n</html>\n"
    )


def text(tag: str, content: str, css: str = "") -> Html:
    """Return an element with text."""
    return Html(f"<{tag}{_class(css)}>{escape(content)}</{tag}>")


def section(title: str, *parts: Html) -> Html:
    """Return a titled part of the page."""
    return Html("<section>\n" + "\n".join([text("h2", title), *parts]) + "\n</section>")


def figure(svg: str, caption: str, keys: Sequence[tuple[str, str, str]] = ()) -> Html:
    """Return a picture with its caption.

    Parameters
    ----------
    svg
        The picture.
    caption
        What to see in it.
    keys
        Of each mark in it: the colour's variable, the shape (`line`, `dash`, `dot`, `bar`, ...), the meaning.
    """
    marks = "".join(
        f'<li><i class="{shape}" style="--c:var(--{colour})"></i>{escape(meaning)}</li>'
        for colour, shape, meaning in keys
    )
    legend = f"<ul>{marks}</ul>" if keys else ""
    return Html(
        f'<figure>\n<div class="sheet">{svg}</div>\n<figcaption>{legend}{escape(caption)}</figcaption>\n</figure>'
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Html:
    """Return a table; columns whose title ends with a blank are text, the others numbers."""
    css = [' class="t"' if title.endswith(" ") else "" for title in head]
    top = "".join(f"<th{c}>{escape(title.strip())}</th>" for title, c in zip(head, css, strict=True))
    body = "\n".join(
        "<tr>" + "".join(f"<td{c}>{escape(cell)}</td>" for cell, c in zip(row, css, strict=True)) + "</tr>"
        for row in rows
    )
    return Html(f'<div class="wide"><table>\n<thead><tr>{top}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>')


def facts(pairs: Iterable[tuple[str, str]]) -> Html:
    """Return the few figures that matter most, side by side."""
    return Html("<dl>" + "".join(f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in pairs) + "</dl>")


def details(title: str, *parts: Html) -> Html:
    """Return parts that open on a click."""
    return Html(f"<details><summary>{escape(title)}</summary>\n" + "\n".join(parts) + "\n</details>")


def _class(css: str) -> str:
    return f' class="{css}"' if css else ""

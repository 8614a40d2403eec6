"""Figures as inline SVG that takes its colours and letters from the page around it.

matplotlib draws with one set of rc values whatever the user has configured; then every colour of the palette becomes
a CSS variable, so that the same figure serves light and dark screens and paper. The bytes depend on the figure alone:
no date, no random names, no process-wide state left changed.
"""

from __future__ import annotations

import functools
import io
import re
from collections.abc import Callable
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from groma.nouns.arrays import Array

INK, MUTED, LINE = "#1b1b1a", "#6b6a65", "#cfcdc6"
FINAL, TRACKED, ODOMETRY = "#0072b2", "#e69f00", "#8a8983"
ACCEPTED, REJECTED, WEAK = "#009e73", "#d55e00", "#aa3377"
"""Wong, Nature Methods 8, 2011, and Tol's bright: distinguished by colour-blind people."""

VARIABLES = {
    INK: "ink",
    MUTED: "muted",
    LINE: "line",
    FINAL: "final",
    TRACKED: "tracked",
    ODOMETRY: "odometry",
    ACCEPTED: "accepted",
    REJECTED: "rejected",
    WEAK: "weak",
}

WIDTH = 7.2
"""Inches, of 72 units each in the SVG."""

_STYLE: dict[Any, Any] = {
    "axes.edgecolor": LINE,
    "axes.labelcolor": MUTED,
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.8,
    "axes.titlecolor": INK,
    "axes.titlelocation": "left",
    "axes.titlepad": 5,
    "axes.titlesize": 10,
    "axes.unicode_minus": True,
    "lines.linewidth": 1.3,
    "path.simplify": True,
    "svg.fonttype": "none",
    "text.color": INK,
    "xtick.color": LINE,
    "xtick.labelcolor": MUTED,
    "xtick.labelsize": 9,
    "ytick.color": LINE,
    "ytick.labelcolor": MUTED,
    "ytick.labelsize": 9,
}


P = ParamSpec("P")


def drawn(label: str) -> Callable[[Callable[P, Figure]], Callable[P, str]]:
    """Turn a function that draws a figure into one that returns it as an SVG element.

    Parameters
    ----------
    label
        What the figure shows, for those who cannot see it.
    """

    def decorate(draw: Callable[P, Figure]) -> Callable[P, str]:
        @functools.wraps(draw)
        def svg(*args: P.args, **kwargs: P.kwargs) -> str:
            with mpl.rc_context():
                mpl.rcdefaults()
                mpl.rcParams.update(_STYLE | {"svg.hashsalt": draw.__name__})
                file = io.StringIO()
                metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
                FigureCanvasSVG(draw(*args, **kwargs)).print_figure(file, format="svg", metadata=metadata)
            return _inline(file.getvalue(), label)

        return svg

    return decorate


def sheet(height: float) -> Figure:
    """Return an empty figure of the width of the page; the height is in inches."""
    return Figure((WIDTH, height), facecolor="none")


def axes(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Add axes without a box, placed in inches from the lower left corner."""
    size = figure.get_figheight()
    ax = figure.add_axes((left / WIDTH, bottom / size, width / WIDTH, height / size))
    ax.patch.set_visible(False)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def thinned(xy: Array, step: float) -> Array:
    """Return the points (M, 2) of a path (N, 2) that lie at least a step of path apart, and the last one."""
    xy = xy[np.isfinite(xy).all(axis=1)]
    if len(xy) < 3:
        return xy
    path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    keep = np.concatenate([[True], np.diff(np.floor(path / step)) > 0])
    keep[-1] = True
    kept: Array = xy[keep]
    return kept


def _inline(svg: str, label: str) -> str:
    body = svg[svg.index("<svg") :]
    box = re.search(r'viewBox="[^"]*"', body)
    head = f'<svg role="img" preserveAspectRatio="xMinYMid" aria-label="{label}" {box.group() if box else ""} xmlns:xlink="http://www.w3.org/1999/xlink">'
    body = head + body[body.index(">") + 1 :]
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r"<style.*?</style>", "", body, flags=re.DOTALL)
    body = re.sub(r' id="[\w.]+_\d+"|<!--.*?-->', "", body, flags=re.DOTALL)
    body = re.sub(r"font-family: [^;\"]*; |image-rendering:[a-z-]+;?", "", body)
    for colour, variable in VARIABLES.items():
        body = body.replace(colour, f"var(--{variable})")
    return re.sub(r"\s*\n\s*", "\n", body).strip()

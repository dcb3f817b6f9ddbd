"""Figures as SVG elements that stand in an HTML page, take its colours in light, dark and print, and load nothing."""

import html
import io
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from wsm_data.view.drawing.style import BAR, BAR_SECOND, GRID, INK, MUTED

THEMED: Mapping[str, str] = MappingProxyType(
    {INK: "var(--ink)", MUTED: "var(--muted)", GRID: "var(--grid)", BAR: "var(--bar)", BAR_SECOND: "var(--bar-second)"}
)
"""Colours the page's style sheet takes over. Every other colour stays as drawn, such as those within a map."""

_NO_METADATA: dict[str, Any] = {"Date": None}  # None takes the entry out; matplotlib's hints allow only text
_CONTENT = re.compile(r"<svg [^>]*?viewBox=\"([^\"]*)\"[^>]*>(.*)</svg>", re.DOTALL)
_HEAD = re.compile(r"<metadata>.*?</metadata>|<style .*?</style>", re.DOTALL)
_ID = re.compile(r' id="([^"]*)"')
_REFERENCE = re.compile(r'(url\(#|href="#)([^")]*)')
_FONT = re.compile(r"(font(?:-family)?: [^;\"]*)'DejaVu Sans'")


def figure_svg(figure: Figure, name: str, description: str) -> str:
    """Render a figure as one `<svg>` element for an HTML page; call within `figure_style()`.

    Text stays text, in the page's own font. Equal figures under an equal name give equal bytes.

    Args:
        figure: what is drawn.
        name: unique in the page, of letters, digits and `-`: the ids within the figure begin with it.
        description: what somebody who cannot see the figure is told; plain text.
    """
    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", transparent=True, metadata=_NO_METADATA)
    parts = _CONTENT.search(buffer.getvalue())
    if parts is None:
        raise RuntimeError("matplotlib wrote an SVG without a root element")
    body = _themed(_own_ids(_HEAD.sub("", parts[2]), name))
    label = html.escape(description, quote=True)
    return f'<svg viewBox="{parts[1]}" role="img" aria-label="{label}">{body}</svg>'


def _own_ids(body: str, name: str) -> str:
    """Put the name before every id that is referred to, and drop the others."""
    used = {reference for _, reference in _REFERENCE.findall(body)}
    body = _ID.sub(lambda match: f' id="{name}-{match[1]}"' if match[1] in used else "", body)
    return _REFERENCE.sub(lambda match: f"{match[1]}{name}-{match[2]}", body).replace("xlink:href", "href")


def _themed(body: str) -> str:
    for colour, variable in THEMED.items():
        body = body.replace(colour, variable)
    return _FONT.sub(r"\1var(--font)", body)

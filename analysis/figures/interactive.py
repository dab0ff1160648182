"""Figures on a page that can be looked at closer: each mark tells its numbers, and finds itself in the others."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from palpate.analysis.figures.compact import compact_svg
from palpate.analysis.figures.drawn import Mark

SCRIPT = Path(__file__).resolve().parent / "interaction.js"
_GROUP = re.compile(r'<g id="([^"]+)"([^>]*)>')
_WIDTH = re.compile(r'viewBox="0 0 ([\d.]+)')
BETWEEN = "\t"
"""What stands between a mark's name and value, and between two keys; a new line stands between two pairs."""


def script() -> str:
    """The page's only script. It needs nothing from outside and changes nothing on paper."""
    return SCRIPT.read_text(encoding="utf-8")


def figure_markup(svg: str, marks: Sequence[Mark], prefix: str, label: str = "") -> Any:
    """The inline SVG whose marks can be pointed at, reached by keys and chosen; `prefix` is that of the SVG's ids.

    A mark that the drawing lacks is left out: a figure may hold more than it shows. `label` names the whole drawing.
    """
    from markupsafe import Markup

    known = {f"{prefix}-{mark.gid}": mark for mark in marks}

    def marked(found: re.Match[str]) -> str:
        mark = known.get(found[1])
        return found[0] if mark is None else f"<g{found[2]}{_attributes(mark)}>"

    drawn = _GROUP.sub(marked, compact_svg(svg, prefix, known))
    named = f' aria-label="{escape(label)}"' if label else ""
    return Markup(f'<div class="drawing" role="group"{named}{_readable(drawn)}>{drawn}</div>')  # names are escaped


def _readable(svg: str) -> str:
    """The width below which a drawing's letters could no longer be read: a narrow screen moves it sideways instead."""
    width = _WIDTH.search(svg)
    return f' style="--least:{float(width[1]):.0f}px"' if width else ""


def _attributes(mark: Mark) -> str:
    """What the script makes the rest from: label, role and the place among the Tab key's stops."""
    told = "\n".join(BETWEEN.join(map(one_line, pair)) for pair in mark.told)
    key = f' data-key="{escape(key_text(mark.key))}"' if mark.key else ""
    return f' class="mark" data-told="{escape(told)}"{key}'


def key_text(*keys: str) -> str:
    """Keys as an attribute holds them."""
    return BETWEEN.join(map(one_line, keys))


def one_line(text: str) -> str:
    """A text without the letters that separate texts here."""
    return " ".join(text.split())

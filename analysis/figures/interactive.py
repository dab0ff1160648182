"""Figures on a page that can be looked at closer: each mark tells its numbers, and finds itself in the others."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from analysis.figures.drawn import Mark

SCRIPT = Path(__file__).parent / "interaction.js"
_GROUP = re.compile(r'<g id="([^"]+)"([^>]*)>')


def script() -> str:
    """The page's only script. It needs nothing from outside and changes nothing on paper."""
    return SCRIPT.read_text(encoding="utf-8")


def figure_markup(svg: str, marks: Sequence[Mark], prefix: str) -> Any:
    """The inline SVG whose marks can be pointed at, reached by keys and chosen; `prefix` is that of the SVG's ids.

    A mark that the drawing lacks is left out: a figure may hold more than it shows.
    """
    from markupsafe import Markup

    known = {f"{prefix}-{mark.gid}": mark for mark in marks}
    first = next((found[1] for found in _GROUP.finditer(svg) if found[1] in known), "")

    def marked(found: re.Match[str]) -> str:
        mark = known.get(found[1])
        return found[0] if mark is None else f'<g id="{found[1]}"{found[2]}{_attributes(mark, found[1] == first)}>'

    return Markup(f'<div class="drawing" role="group">{_GROUP.sub(marked, svg)}</div>')  # names are escaped below


def _attributes(mark: Mark, first: bool) -> str:
    """Only a figure's first mark is a stop of the Tab key; the arrow keys go on from there."""
    told = json.dumps([list(pair) for pair in mark.told], ensure_ascii=False)
    label = ", ".join(": ".join(filter(None, pair)) for pair in mark.told)
    values: Mapping[str, str] = {
        "class": "mark", "role": "img", "tabindex": "0" if first else "-1", "aria-label": label, "data-told": told,
        "data-key": mark.key,
    }  # fmt: skip
    return "".join(f' {name}="{escape(value)}"' for name, value in values.items() if value)

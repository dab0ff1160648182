"""Figures on a page that can be looked at closer: each mark tells its numbers, and finds itself in the others."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from html import escape
from pathlib import Path
from typing import Any

from palpate.analysis.figures.figure_kind import Mark

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


_LENGTH = re.compile(r'(?<= d=")[^"]*|translate\([^)]*\)|(?<= x=")[^"]*|(?<= y=")[^"]*')
_LONG = re.compile(r"-?\d+\.\d{3,}(?:e-?\d+)?")
_GROUP_ID = re.compile(r'<g id="([^"]*)"')
_USED = re.compile(r'(?:href="|url\()#([^")]*)')
_EMPTY = re.compile(r"<g\s*/>|<g\s*>\s*</g>")
_STYLE = re.compile(r'(<(?:path|use|rect|g)\b(?! id=)[^>]*?) style="([^"]*)"')


def compact_svg(svg: str, prefix: str, kept: Collection[str]) -> str:
    """The same picture in fewer bytes: lengths to a hundredth of a point, each style once, no ids that nothing uses.

    `kept` are the ids of groups that stay; `prefix` makes the styles' names the figure's own.
    """
    used = {*kept, *_USED.findall(svg)}
    svg = _LENGTH.sub(_shorter, svg.replace("xlink:href=", "href="))
    svg = _GROUP_ID.sub(lambda found: found[0] if found[1] in used else "<g", svg)
    svg = re.sub(r">\s+<", "><", svg)
    while (less := _EMPTY.sub("", svg)) != svg:
        svg = less
    return _styled_once(svg, prefix)


def _shorter(found: re.Match[str]) -> str:
    return " ".join(_LONG.sub(lambda long: _rounded(float(long[0])), found[0]).split())


def _rounded(value: float) -> str:
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _styled_once(svg: str, prefix: str) -> str:
    """Each style as a rule of the drawing's own, in the order of first use."""
    names: dict[str, str] = {}

    def named(found: re.Match[str]) -> str:
        return f'{found[1]} class="{names.setdefault(found[2], f"{prefix}s{len(names)}")}"'

    svg = _STYLE.sub(named, svg)
    rules = "".join(f".{name}{{{style.replace('; ', ';').replace(': ', ':')}}}" for style, name in names.items())
    return re.sub(r"(<svg[^>]*>)", lambda found: f"{found[1]}<style>{rules}</style>", svg, count=1) if names else svg

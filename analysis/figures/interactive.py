"""Interactive figures on a page: marks show their numbers, and highlight related marks in other figures."""

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
"""The separator of a mark's name and value, and of two keys; pairs are separated by new lines."""
_LENGTH = re.compile(r'(?<= d=")[^"]*|translate\([^)]*\)|(?<= x=")[^"]*|(?<= y=")[^"]*')
_LONG = re.compile(r"-?\d+\.\d{3,}(?:e-?\d+)?")
_GROUP_ID = re.compile(r'<g id="([^"]*)"')
_USED = re.compile(r'(?:href="|url\()#([^")]*)')
_EMPTY = re.compile(r"<g\s*/>|<g\s*>\s*</g>")
_STYLE = re.compile(r'(<(?:path|use|rect|g)\b(?! id=)[^>]*?) style="([^"]*)"')


def script() -> str:
    """Return the page's only script. It needs no external resources and changes nothing on paper."""
    return SCRIPT.read_text(encoding="utf-8")


def figure_markup(svg: str, marks: Sequence[Mark], prefix: str, label: str = "") -> Any:
    """Return inline SVG whose marks react to pointing, keyboard focus and choosing.

    `prefix` is that of the SVG's ids; `label` names the whole drawing. A mark without an element in the drawing is left
    out, since a figure may have more data than it shows.
    """
    from markupsafe import Markup

    known = {f"{prefix}-{mark.gid}": mark for mark in marks}

    def add_attributes(match: re.Match[str]) -> str:
        mark = known.get(match[1])
        if mark is None:
            return match[0]
        # From these the script makes the rest: label, role and the place among the Tab key's stops.
        details = "\n".join(BETWEEN.join(map(one_line, pair)) for pair in mark.details)
        key = f' data-key="{escape(key_text(mark.key))}"' if mark.key else ""
        return f'<g{match[2]} class="mark" data-details="{escape(details)}"{key}>'

    drawing = _GROUP.sub(add_attributes, compact_svg(svg, prefix, known))
    labelled = f' aria-label="{escape(label)}"' if label else ""
    # The width below which the letters could not be read: a narrow screen moves the drawing sideways instead.
    width = _WIDTH.search(drawing)
    least_width = f' style="--least:{float(width[1]):.0f}px"' if width else ""
    return Markup(f'<div class="drawing" role="group"{labelled}{least_width}>{drawing}</div>')  # names are escaped


def key_text(*keys: str) -> str:
    """Return keys as the text of an attribute."""
    return BETWEEN.join(map(one_line, keys))


def one_line(text: str) -> str:
    """Return a text without the characters that separate texts here."""
    return " ".join(text.split())


def compact_svg(svg: str, prefix: str, keep: Collection[str]) -> str:
    """Return the same picture in fewer bytes: lengths in hundredths of a point, each style once, no unused ids.

    `keep` are the ids of groups that stay; `prefix` makes the styles' names unique to the figure.
    """
    used = {*keep, *_USED.findall(svg)}

    def round_number(match: re.Match[str]) -> str:
        text = f"{float(match[0]):.2f}".rstrip("0").rstrip(".")
        return "0" if text == "-0" else text

    def round_lengths(match: re.Match[str]) -> str:
        return " ".join(_LONG.sub(round_number, match[0]).split())

    svg = _LENGTH.sub(round_lengths, svg.replace("xlink:href=", "href="))
    svg = _GROUP_ID.sub(lambda match: match[0] if match[1] in used else "<g", svg)
    svg = re.sub(r">\s+<", "><", svg)
    while (shorter := _EMPTY.sub("", svg)) != svg:
        svg = shorter
    # Each style becomes a rule of the drawing's own, in the order of first use.
    names: dict[str, str] = {}

    def add_class(match: re.Match[str]) -> str:
        return f'{match[1]} class="{names.setdefault(match[2], f"{prefix}s{len(names)}")}"'

    svg = _STYLE.sub(add_class, svg)
    rules = "".join(f".{name}{{{style.replace('; ', ';').replace(': ', ':')}}}" for style, name in names.items())
    return re.sub(r"(<svg[^>]*>)", lambda match: f"{match[1]}<style>{rules}</style>", svg, count=1) if names else svg

"""A drawing's SVG without what a page does not need: the figures are the longest part of a page."""

from __future__ import annotations

import re
from collections.abc import Collection

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

"""Drawn figures as blocks of a page."""

from __future__ import annotations

from collections.abc import Sequence

from palpate.analysis.figures.interactive import figure_markup
from palpate.analysis.figures.style import inline_svg
from palpate.analysis.reports.blocks import Picture
from palpate.analysis.reports.captions import caption
from palpate.analysis.reports.drawn import Pictured


def figure_block(each: Pictured, numbered: str = "") -> Picture:
    """The figure on a page, its marks to be pointed at."""
    prefix = each.name.replace("_", "")
    markup = figure_markup(inline_svg(each.svg, prefix), each.marks, prefix, each.title)
    title = f"{numbered}. {each.title}" if numbered else each.title
    return Picture(f"figure-{each.name}", title.rstrip("."), caption(each.caption), markup)


def chosen(pictured: Sequence[Pictured], *names: str) -> list[Pictured]:
    """The figures whose names begin so, in the order of the names."""
    return [each for name in names for each in pictured if each.name.startswith(name)]

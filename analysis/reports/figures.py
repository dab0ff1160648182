"""Drawn figures of reports, and their blocks on a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.figure_kind import Mark
from palpate.analysis.figures.interactive import figure_markup
from palpate.analysis.figures.style import inline_svg, save
from palpate.analysis.reports.page import FigureBlock, caption

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class DrawnFigure:
    """A drawn figure: its name, title and caption, the text of its SVG, and its marks with details."""

    name: str
    title: str
    caption: str
    svg: str
    marks: tuple[Mark, ...] = ()


def drawn_figure(name: str, title: str, caption: str, figure: Figure, folder: Path) -> DrawnFigure:
    """Write NAME.svg and NAME.png (call it within `drawing`) and return the figure for the page."""
    svg, _ = save(figure, folder, name)
    return DrawnFigure(name, title, caption, svg.read_text(encoding="utf-8"))


def figure_block(figure: DrawnFigure, numbered: str = "") -> FigureBlock:
    """Return the figure as a block with interactive marks; `numbered` precedes its title."""
    prefix = figure.name.replace("_", "")
    markup = figure_markup(inline_svg(figure.svg, prefix), figure.marks, prefix, figure.title)
    title = f"{numbered}. {figure.title}" if numbered else figure.title
    return FigureBlock(f"figure-{figure.name}", f"{title.rstrip('.')}.", caption(figure.caption), markup)


def chosen(figures: Sequence[DrawnFigure], *names: str) -> list[DrawnFigure]:
    """Return the figures whose names begin with one of these, in the order of the names."""
    return [figure for name in names for figure in figures if figure.name.startswith(name)]

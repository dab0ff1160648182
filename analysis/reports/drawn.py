"""A figure of the report as it was drawn."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.analysis.figures.figure_kind import Mark
from palpate.analysis.figures.style import save

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Pictured:
    """A drawn figure: its name, title and caption, its SVG's text, and the marks in it that can be looked at closer."""

    name: str
    title: str
    caption: str
    svg: str
    marks: tuple[Mark, ...] = ()


def drawn_figure(name: str, title: str, caption: str, figure: Figure, folder: Path) -> Pictured:
    """Write NAME.svg and NAME.png (call it within `drawing`) and give the figure for the page."""
    svg, _ = save(figure, folder, name)
    return Pictured(name, title, caption, svg.read_text(encoding="utf-8"))

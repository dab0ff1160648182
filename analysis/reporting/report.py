"""The report: one HTML file that needs nothing else, the same bytes for the same inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.reporting.analysed import Analysed
from analysis.reporting.figure_data import Picture, reference_level
from analysis.reporting.figures import means_figure, trends_figure
from analysis.reporting.page import level_table, page_of
from analysis.reporting.page_table import Table
from analysis.reporting.page_text import phrase
from analysis.reporting.pictures import picture
from analysis.reporting.style import drawing, inline_svg, save, svg_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Drawing:
    """A figure to be drawn: its file name, its title and caption, and how."""

    name: str
    title: str
    caption: str
    draw: Callable[[Picture], Figure]


@dataclass(frozen=True)
class ReportFigure:
    """A figure as it stands in the report, with the numbers that it shows."""

    title: str
    caption: str
    svg: Any
    table: Table


def drawings(found: Analysed, shown: Picture) -> Iterator[Drawing]:
    """The figures that this data set has: the means, and the trends where levels follow each other."""
    factors = phrase(shown_names(found))
    sd = "Bars are means over participants, whiskers ± 1 standard deviation across participants"
    yield Drawing("means", f"Mean ratings by {factors}.", f"{sd}, on the study's scale.", means_figure)
    if any(len(levels) > 1 for _, levels in shown.families()) and len(shown.families()) > 1:
        family = found.ratings.families or found.ratings.within[0]
        note = "Points are means over participants; lines join the levels of one family."
        if reference_level(shown) is not None:
            note += f" A ring and the dotted line across mark {shown.written(shown.levels[0])}, the reference."
        title = f"Mean ratings within each {family}."
        yield Drawing("trends", title, note, trends_figure)


def shown_names(found: Analysed) -> tuple[str, ...]:
    """The factors on the axes of the figures."""
    from analysis.reporting.pictures import shown_factors

    return shown_factors(found.ratings)


def save_figures(found: Analysed, folder: Path) -> list[Path]:
    """Write every figure as SVG and PNG to `folder` and give the paths."""
    shown = picture(found.ratings, found.levels)
    paths: list[Path] = []
    for each in drawings(found, shown):
        with drawing(each.name):
            paths += save(each.draw(shown), folder, each.name)
    return paths


def report_html(found: Analysed) -> str:
    """The whole report as one HTML text, every name in it escaped, every figure inline."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    css = (TEMPLATES / "report.css").read_text(encoding="utf-8")
    template = environment.get_template("report.html")
    return template.render(page=page_of(found), figures=list(_figures(found)), css=_trusted(css))


def write_report(found: Analysed, path: Path) -> Path:
    """Write the report to `path`, its folder made where missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(report_html(found), encoding="utf-8", newline="\n")
    return path


def _figures(found: Analysed) -> Iterator[ReportFigure]:
    shown = picture(found.ratings, found.levels)
    numbers = level_table(found)
    for index, each in enumerate(drawings(found, shown)):
        with drawing(each.name):
            svg = inline_svg(svg_text(each.draw(shown)), f"f{index + 1}")
        yield ReportFigure(each.title, each.caption, _trusted(svg), numbers)


def _trusted(markup: str) -> Any:
    """Text that is ours and already markup: our style sheet, and drawings whose letters are outlines."""
    from markupsafe import Markup

    return Markup(markup)  # no name of a study or a participant is in it

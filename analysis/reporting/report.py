"""The report: one HTML file that needs nothing else, the same bytes for the same inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.figures.style import drawing, inline_svg, save, svg_text
from analysis.reporting.analysed import Analysed
from analysis.reporting.figure_data import Picture, reference_level
from analysis.reporting.figures import means_figure, trends_figure
from analysis.reporting.page import level_table, page_of
from analysis.reporting.page_table import Table
from analysis.reporting.page_text import phrase
from analysis.reporting.pictures import picture, shown_factors

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
    factors, people = phrase(shown_factors(found.ratings)), shown.people()
    scale = "on the declared scale" if found.ratings.scale else "on the range of the data"
    sd = f"Bars are means over {people}, whiskers ± 1 standard deviation across participants, {scale}.{_unequal(found)}"
    yield Drawing("means", f"Mean ratings by {factors}.", sd, means_figure)
    if any(len(levels) > 1 for _, levels in shown.families()) and len(shown.families()) > 1:
        family = found.ratings.families or found.ratings.within[0]
        note = f"Points are means over {people}; their spread is drawn in Figure 1, not here."
        note += f" Lines join the levels of one family.{_unequal(found)}"
        if reference_level(shown) is not None:
            note += f" A ring and the dotted line across mark {shown.written(shown.levels[0])}, the reference."
        title = f"Mean ratings within each {family}."
        yield Drawing("trends", title, note, trends_figure)


def _unequal(found: Analysed) -> str:
    """What a caption says where participants' means at one level rest on unequal numbers of ratings."""
    least, most = found.levels["ratings_min"], found.levels["ratings_max"]
    uneven = least != most
    if not uneven.any():
        return ""
    return f" Not every participant's mean rests on as many ratings: {least[uneven].min()} to {most[uneven].max()}."


def save_figures(found: Analysed, folder: Path) -> list[Path]:
    """Write every figure as SVG and PNG to `folder` and give the paths; none where no factor has levels to show."""
    if not shown_factors(found.ratings):
        return []
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
    if not shown_factors(found.ratings):
        return
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

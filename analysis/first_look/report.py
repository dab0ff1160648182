"""The report: one HTML file that needs nothing else, the same bytes for the same inputs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.analysis.figures.style import drawing, inline_svg, save, svg_text
from palpate.analysis.first_look.analysed import Analysed
from palpate.analysis.first_look.page import level_table, page_of
from palpate.analysis.first_look.pictures import pictures
from palpate.analysis.reports.page_table import Table
from palpate.analysis.reports.templates import environment
from palpate.protocols.files import staged_files, write_text

TEMPLATES = Path(__file__).resolve().parent / "templates"
CSS = Path(__file__).resolve().parent.parent / "reports" / "templates" / "report.css"


@dataclass(frozen=True)
class ReportFigure:
    """A figure as it stands in the report, with the numbers that it shows."""

    title: str
    caption: str
    svg: Any
    table: Table


def save_figures(found: Analysed, folder: Path) -> list[Path]:
    """Write every figure as SVG and PNG to `folder` and give the paths; none where no factor has levels to show."""
    paths: list[Path] = []
    with staged_files(folder) as draft:
        for each in pictures(found.ratings):
            with drawing(each.name):
                paths += save(each.draw(each.data).figure, draft, each.name)
    return [folder / path.name for path in paths]


def report_html(found: Analysed) -> str:
    """The whole report as one HTML text, every name in it escaped, every figure inline."""
    css = CSS.read_text(encoding="utf-8")
    template = environment(TEMPLATES).get_template("report.html")
    return template.render(page=page_of(found), figures=list(_figures(found)), css=_trusted(css))


def write_report(found: Analysed, path: Path) -> Path:
    """Write the report to `path`, its folder made where missing."""
    return write_text(path, report_html(found))


def _figures(found: Analysed) -> Iterator[ReportFigure]:
    numbers = level_table(found)
    for index, each in enumerate(pictures(found.ratings), start=1):
        with drawing(each.name):
            svg = inline_svg(svg_text(each.draw(each.data).figure), f"f{index}")
        yield ReportFigure(each.data.title, each.data.caption, _trusted(svg), numbers)


def _trusted(markup: str) -> Any:
    """Text that is ours and already markup: our style sheet, and drawings whose letters are outlines."""
    from markupsafe import Markup

    return Markup(markup)  # no name of a study or a participant is in it

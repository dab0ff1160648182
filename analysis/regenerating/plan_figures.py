"""Every figure of a plan: its data from the selected rows and the answers, and its drawing from the data alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.analysis.figures.figure_kind import FigureData, FigureInput, FigureSettings
from palpate.analysis.figures.style import drawing, save, svg_text
from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.idle import effective, idle_notes
from palpate.analysis.plans.kinds import FIGURES
from palpate.analysis.plans.selecting import Selector
from palpate.analysis.reports.figures import DrawnFigure
from palpate.protocols.progress import Progress


@dataclass(frozen=True)
class PlannedFigure:
    """A figure of the plan with its data, or with the reason why there are none."""

    settings: FigureSettings
    data: FigureData | None
    refused: str = ""


def figure_data(selector: Selector, answers: Mapping[str, Mapping[str, Answer]]) -> tuple[PlannedFigure, ...]:
    """Return the data of every figure of the plan, or the reason why a figure has none."""
    return tuple(_planned(selector, answers, settings) for settings in selector.plan.figures)


def _planned(
    selector: Selector, answers: Mapping[str, Mapping[str, Answer]], settings: FigureSettings
) -> PlannedFigure:
    kind = FIGURES[settings.figure]
    used = effective(settings, kind)
    try:
        missing = [name for name in used.tests if name not in answers]
        if missing:
            return PlannedFigure(settings, None, f"it shows the test {missing[0]!r}, which has no answer")
        given = FigureInput(selector.of(used, kind), {name: answers[name] for name in used.tests})
        data = kind.data(given, used)
        data = replace(data, caption=" ".join((data.caption, *idle_notes(settings, kind))))
    except ValueError as refusal:
        return PlannedFigure(settings, None, str(refusal))
    return PlannedFigure(settings, data)


def draw_all(
    figures: Sequence[PlannedFigure], folder: Path | None, progress: Progress = lambda *_: None
) -> Iterator[DrawnFigure | None]:
    """Draw each figure (None if it has no data), and write NAME.svg and NAME.png if a folder is given."""
    for done, figure in enumerate(figures):
        progress(done, len(figures), f"drawing {figure.settings.name}")
        settings, data = figure.settings, figure.data
        if data is None:
            yield None
            continue
        with drawing(settings.name):
            drawn = FIGURES[settings.figure].draw(data)
            files = save(drawn.figure, folder, settings.name) if folder is not None else []
            svg = svg_text(drawn.figure) if folder is None else files[0].read_text(encoding="utf-8")
        title = (settings.title or data.title).rstrip(".")
        yield DrawnFigure(settings.name, title, data.caption, svg, drawn.marks)
    progress(len(figures), len(figures), "")

"""Every figure of a plan: its data from the selected rows and the answers, and its drawing from the data alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from palpate.analysis.figures.figure_kind import FigureData, FigureInput, FigureSettings, Mark
from palpate.analysis.figures.style import drawing, save, svg_text
from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.idle import effective, idle_notes
from palpate.analysis.plans.kinds import FIGURES
from palpate.analysis.plans.selecting import Selecting
from palpate.protocols.progress import Progress


@dataclass(frozen=True)
class Pictured:
    """A figure of the plan with its data, or with the reason why there is none."""

    asked: FigureSettings
    data: FigureData | None
    refused: str = ""


@dataclass(frozen=True)
class Picture:
    """A drawn figure: the text of its SVG and the marks in it."""

    svg: str
    marks: tuple[Mark, ...]


def picture_data(selecting: Selecting, answers: Mapping[str, Mapping[str, Answer]]) -> tuple[Pictured, ...]:
    """The data of every figure of the plan; a figure that has nothing to show says why."""
    return tuple(_pictured(selecting, answers, asked) for asked in selecting.plan.figures)


def _pictured(selecting: Selecting, answers: Mapping[str, Mapping[str, Answer]], asked: FigureSettings) -> Pictured:
    kind = FIGURES[asked.figure]
    settings = effective(asked, kind)
    try:
        lacking = [name for name in settings.tests if name not in answers]
        if lacking:
            return Pictured(asked, None, f"it shows the test {lacking[0]!r}, which has no answer")
        shown = FigureInput(selecting.of(settings, kind.takes), {name: answers[name] for name in settings.tests})
        data = kind.data(shown, settings)
        data = replace(data, caption=" ".join((data.caption, *idle_notes(asked, kind))))
    except ValueError as refusal:
        return Pictured(asked, None, str(refusal))
    return Pictured(asked, data)


def draw_all(
    pictured: tuple[Pictured, ...], folder: Path | None, progress: Progress = lambda *_: None
) -> Iterator[Picture | None]:
    """Draw each figure (None where there is none), and write NAME.svg and NAME.png where a folder is given."""
    for done, each in enumerate(pictured):
        progress(done, len(pictured), f"drawing {each.asked.name}")
        yield None if each.data is None else _drawn(each.asked, each.data, folder)
    progress(len(pictured), len(pictured), "")


def _drawn(asked: FigureSettings, data: FigureData, folder: Path | None) -> Picture:
    with drawing(asked.name):
        drawn = FIGURES[asked.figure].draw(data)
        files = save(drawn.figure, folder, asked.name) if folder is not None else []
        svg = svg_text(drawn.figure) if folder is None else files[0].read_text(encoding="utf-8")
    return Picture(svg, drawn.marks)

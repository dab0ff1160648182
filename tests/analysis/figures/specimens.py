"""Small hand-made selections and answers for figures."""

from __future__ import annotations

import pandas as pd

from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind
from palpate.analysis.figures.style import drawing, svg_text
from palpate.analysis.plans.answers import Answer, Selected

NOTHING = pd.DataFrame({"participant": pd.Series(dtype=object)})


def selected(table: pd.DataFrame = NOTHING, **more: object) -> Selected:
    known = {"trials": NOTHING, "outcomes": (), "levels": {}}
    return Selected(table=table, **{**known, **more})  # type: ignore[arg-type]


def answer(rows: list[dict], method: str = "Made by hand.", **more: object) -> Answer:
    return Answer(tuple(rows), method, {}, participants=2, values=len(rows), **more)  # type: ignore[arg-type]


def inputs_of(table: pd.DataFrame = NOTHING, answers: dict | None = None, **more: object) -> FigureInput:
    return FigureInput(selected(table, **more), {name: {"": result} for name, result in (answers or {}).items()})


def data_of(kind: FigureKind, inputs: FigureInput, **settings: object) -> FigureData:
    """The data of a figure of that kind."""
    name = kind.settings.model_fields["figure"].annotation.__args__[0]  # type: ignore[union-attr]
    return kind.data(inputs, kind.settings(name="made", figure=name, **settings))


def draw_svg(kind: FigureKind, data: FigureData) -> tuple[str, DrawnFigure]:
    """The drawing as SVG, and its marks."""
    with drawing(data.title):
        drawn = kind.draw(data)
        return svg_text(drawn.figure), drawn

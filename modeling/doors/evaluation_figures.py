"""Figures 5.12 to 5.14 of the thesis, work-precision plots, learning curves, made profiles beside measured ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.analysis.figures.figure_kind import FigureInput, FigureKind
from palpate.analysis.figures.style import drawing, save
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.doors.evaluation import DoorEvaluation
from palpate.modeling.doors.evaluation_overall import widths
from palpate.modeling.doors.evaluation_profiles import made_profiles, measured_door
from palpate.modeling.doors.evaluation_results import curve_rows
from palpate.modeling.doors.evaluation_tables import prediction_rows, waveform_error_rows
from palpate.modeling.doors.evaluation_words import CURVES, WORK_PRECISION
from palpate.modeling.doors.results import MethodResults
from palpate.protocols.undefined import nan_to_none

if TYPE_CHECKING:
    from palpate.modeling.training.history import Epoch

UNIT = "0 to 100"


def figures(evaluation: DoorEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Draw every figure that the evaluation has something for, and write NAME.svg and NAME.png into the folder."""
    forward = _of(
        evaluation.results.methods("forward"),
        evaluation.choices["forward"].method if "forward" in evaluation.choices else "",
    )
    inverse = _of(
        evaluation.results.methods("inverse"),
        evaluation.choices["inverse"].method if "inverse" in evaluation.choices else "",
    )
    if forward is not None:
        yield from _predicted(forward, folder)
    if inverse is not None:
        yield _violins(inverse, folder)
        yield made_profiles(evaluation, inverse, folder)
    if evaluation.measured:
        yield measured_door(evaluation, folder)
    yield from _work_precision(evaluation, folder)
    yield from _curves(evaluation, folder)


def _of(methods: Sequence[MethodResults], name: str) -> MethodResults | None:
    return next((method for method in methods if method.method == name), None)


def _predicted(results: MethodResults, folder: Path) -> Iterator[DrawnFigure]:
    """Figures 5.12 and 5.13: by door and by attribute."""
    from palpate.analysis.figures.predicted import PREDICTED

    rows = prediction_rows(results, widths(results))
    for name, panels, colour in (("figure_5_12", "door", "attribute"), ("figure_5_13", "attribute", "door")):
        settings: dict[str, Any] = {"panels": panels, "colour": colour, "unit": UNIT, "band": "global"}
        settings |= {} if any(row["sd"] is not None for row in rows) else {"sd": 10.0}
        shown_rows = [{key: value for key, value in row.items() if key not in ("low", "high")} for row in rows]
        yield _planned_figure(PREDICTED, {"name": name, "figure": "predicted", **settings}, shown_rows, results, folder)


def _violins(results: MethodResults, folder: Path) -> DrawnFigure:
    """Figure 5.14: the waveform's MAE by door."""
    from palpate.analysis.figures.violins import VIOLINS

    title = "Waveform error of made profiles by door"
    settings = {
        "name": "figure_5_14",
        "figure": "violins",
        "by": "door",
        "value": "mae",
        "unit": "% of the range of forces",
    }
    return _planned_figure(VIOLINS, {**settings, "title": title}, waveform_error_rows(results), results, folder)


def _planned_figure(
    kind: FigureKind, asked: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], results: MethodResults, folder: Path
) -> DrawnFigure:
    settings = kind.settings.model_validate(asked)
    shown = kind.data(FigureInput(_selected(rows, results)), settings)
    with drawing(settings.name):
        drawn = kind.draw(shown)
        svg, _ = save(drawn.figure, folder, settings.name)
    return DrawnFigure(settings.name, shown.title, shown.caption, svg.read_text(encoding="utf-8"), drawn.marks)


def _selected(rows: Sequence[Mapping[str, Any]], results: MethodResults) -> Any:
    """Return the rows as a figure of a plan gets them, with the levels in the data's order."""
    import pandas as pd

    from palpate.analysis.plans.answers import Selected

    table = pd.DataFrame([dict(row) for row in rows])
    data = results.data
    levels = {name: tuple(dict.fromkeys(values)) for name, values in
              (("attribute", data.attributes), ("door", data.doors), ("variant", data.variants))}  # fmt: skip
    antonyms = dict(zip(data.attributes, data.antonyms, strict=True))
    return Selected(table, table.iloc[:0], data.attributes, levels, antonyms=antonyms)


def _work_precision(evaluation: DoorEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Error against the time of training and of an answer, a figure for each direction."""
    from palpate.analysis.measuring.work_precision_plot import work_precision_figure

    panels = {
        "forward": (evaluation.forward, "mae", "From force to feeling", "MAE, 0 to 100"),
        "inverse": (evaluation.inverse, "waveform_mae", "From feeling to force", "waveform MAE, % of the range"),
    }
    for way, (of, error, title, kind) in panels.items():
        rows = [*_timed_rows(of, error, "train_s", 1.0, ("training", kind)),
                *_timed_rows(of, error, "file_ms", 1e-3, ("an answer", kind))]  # fmt: skip
        if rows:
            name = f"work_precision_{way}"
            with drawing(name):
                yield drawn_figure(
                    name, f"{title}: error against time", WORK_PRECISION, work_precision_figure(rows), folder
                )


def _timed_rows(
    of: Sequence[Mapping[str, Any]], error: str, seconds: str, unit: float, named: tuple[str, str]
) -> list[Any]:
    from palpate.analysis.measuring.rows import MEASURED, Row

    case, kind = named
    return [
        Row("doors", case, row["method"], "all folds", 0, kind, row[error], MEASURED, row[seconds] * unit, 1, None)
        for row in of
        if row[seconds]
    ]


def _curves(evaluation: DoorEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield the learning curves of every method that is trained in epochs, a line for each fold."""
    from palpate.modeling.training.learning_curve import learning_curve

    for method in (*evaluation.results.methods("forward"), *evaluation.results.methods("inverse")):
        if histories := _histories(method):
            name = f"learning_{method.direction}_{method.method}"
            title = f"Learning curves: {evaluation.results.domain.methods[method.direction][method.method].title}"
            with drawing(name):
                last = method.method == "network_thesis"
                yield drawn_figure(name, title, CURVES, learning_curve(histories, last), folder)


def _histories(results: MethodResults) -> dict[str, list[Epoch]]:
    from palpate.modeling.training.history import Epoch

    histories: dict[str, list[Epoch]] = {}
    for row in curve_rows(results):
        held = nan_to_none(row["held_loss"])
        epoch = Epoch(int(row["epoch"]), row["seconds"], row["learning_rate"], row["train_loss"], held)
        histories.setdefault(f"fold {row['fold']}", []).append(epoch)
    return histories

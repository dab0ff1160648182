"""Figures 3.8 and 3.9 of the thesis, error against time, learning curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.analysis.figures.figure_kind import FigureInput, FigureKind
from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing, save
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.attributes.entries import MAIN, PROPOSED
from palpate.modeling.attributes.evaluation import words
from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation, choice
from palpate.modeling.attributes.evaluation.tables import Row, attribute_rows, method_rows, names_of, prediction_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


UNIT = "-100 to 100"
MOST = 8
"""The most textures with learning curves that can be distinguished in one figure."""
COLOURS, SHAPES = (INK, *OKABE_ITO), ("o", "s", "D")
"""Colours of methods, and a marker shape for each round of the colours."""
PANELS = (("train_s", "training of a fold, s"), ("answer_s", "answer for a texture, s"))


def figures(evaluation: AttributeEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Draw every figure that the evaluation has data for, and write NAME.svg and NAME.png into the folder.

    Figures 3.8 and 3.9 show the best method, and the thesis' network where that is another one.
    """
    rows = method_rows(evaluation)
    answered = [row["method"] for row in rows if row["mae"] is not None]
    drawn = [name for name in dict.fromkeys((choice(rows).method, PROPOSED)) if name in answered]
    for place, name in enumerate(drawn):
        end, title = "" if place == 0 else f"_{name}", next(row["title"] for row in rows if row["method"] == name)
        # predictions and ratings on -100..100 (thesis 3.3.3)
        own = [{**row, "actual": 2 * row["rated"] - 100, "predicted": 2 * row["predicted"] - 100,
                "sd": None if row["rated_sd"] is None else 2 * row["rated_sd"]}
               for row in prediction_rows(evaluation) if row["method"] == name]  # fmt: skip
        yield _texture_panels(evaluation, own, title, f"figure_3_8{end}", folder)
        yield _scatter(evaluation, own, name, title, f"scatter_3_8{end}", folder)
        yield _class_heatmap(evaluation, name, title, f"figure_3_9{end}", folder)
    yield from time_figures(rows, folder)
    yield from _curves(evaluation, folder)


def _texture_panels(
    evaluation: AttributeEvaluation, rows: Sequence[Row], title: str, name: str, folder: Path
) -> DrawnFigure:
    """Draw figure 3.8: ratings and predictions of each texture, with a panel for each attribute."""
    from matplotlib.figure import Figure

    names, tested = names_of(evaluation), evaluation.tested
    with drawing(name):
        figure = Figure(figsize=(max(6.4, 0.19 * len(tested) + 1.2), 1.75 * len(names) + 0.9), layout="constrained")
        grid = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
        for axes, attribute in zip(grid, names, strict=True):
            _panel(axes, [row for row in rows if row["attribute"] == attribute], attribute)
        grid[-1].set_xticks(range(len(tested)), tested, rotation=90, fontsize=7)
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2, frameon=False)
        caption = words.FIGURE_3_8.format(title=title)
        return drawn_figure(name, f"Predicted and rated, by texture: {title}", caption, figure, folder)


def _panel(axes: Axes, rows: Sequence[Row], attribute: str) -> None:
    low, _, high = attribute.partition("-")
    for place, row in enumerate(rows):
        axes.plot([place, place], [row["actual"], row["predicted"]], color=SOFT, linewidth=0.8, zorder=1)
        if row["sd"] is not None:
            ends = [max(-100.0, row["actual"] - row["sd"]), min(100.0, row["actual"] + row["sd"])]
            axes.plot([place, place], ends, color=INK, linewidth=2.5, alpha=0.18, zorder=0)
    for key, label, colour, shape in (("actual", "rated", INK, "o"), ("predicted", "predicted", OKABE_ITO[0], "D")):
        axes.plot(range(len(rows)), [row[key] for row in rows], shape, color=colour, markersize=3.5, label=label)
    axes.set(ylim=(-105, 105), xlim=(-0.8, len(rows) - 0.2), yticks=(-100, 0, 100))
    axes.set_yticklabels([f"{low} -100", "0", f"{high} 100"], fontsize=7.5)
    axes.grid(visible=True, axis="y")


def _scatter(
    evaluation: AttributeEvaluation, rows: Sequence[Row], method: str, title: str, name: str, folder: Path
) -> DrawnFigure:
    """Draw predictions against ratings, with 90 % intervals."""
    from palpate.analysis.figures.predicted import PREDICTED

    wide = {row["attribute"]: row["half_width"] for row in attribute_rows(evaluation) if row["method"] == method}
    points = []
    for row in rows:
        point = {name: row[name] for name in ("attribute", "class", "actual", "predicted", "sd")}
        point["stimulus"] = row["texture"]
        if (half := wide[row["attribute"]]) is not None:
            point["low"] = max(-100.0, row["predicted"] - 2 * half)
            point["high"] = min(100.0, row["predicted"] + 2 * half)
        points.append(point)
    settings: dict[str, Any] = {"name": name, "figure": "predicted", "panels": "attribute", "unit": UNIT,
                             "title": f"Predicted against rated: {title}"}  # fmt: skip
    settings |= {} if any(row["sd"] is not None for row in rows) else {"sd": 20.0}
    return _planned_figure(PREDICTED, settings, points, evaluation, folder)


def _class_heatmap(evaluation: AttributeEvaluation, method: str, title: str, name: str, folder: Path) -> DrawnFigure:
    """Draw figure 3.9: the MAE (0 to 100) of each class and attribute."""
    from palpate.analysis.figures.class_heatmap import CLASS_HEATMAP

    rows = [{"stimulus": row["texture"], "class": row["class"].replace("_", " "), "attribute": row["attribute"],
             "actual": row["rated"], "predicted": row["predicted"]}
            for row in prediction_rows(evaluation) if row["method"] == method]  # fmt: skip
    settings = {"name": name, "figure": "class_heatmap", "unit": "0 to 100", "title": words.CLASSES.format(title=title)}
    return _planned_figure(CLASS_HEATMAP, {**settings, "order": "error"}, rows, evaluation, folder)


def _planned_figure(
    kind: FigureKind, plain: dict[str, Any], rows: Sequence[Row], evaluation: AttributeEvaluation, folder: Path
) -> DrawnFigure:
    """Draw a figure kind of the analysis plans from the evaluation's rows."""
    import pandas as pd

    from palpate.analysis.plans.answers import Selected

    table = pd.DataFrame(list(rows))
    levels = {"attribute": tuple(names_of(evaluation)), "class": tuple(dict.fromkeys(table["class"]))}
    settings = kind.settings.model_validate(plain)
    shown = kind.data(FigureInput(Selected(table, table.iloc[:0], tuple(names_of(evaluation)), levels)), settings)
    with drawing(settings.name):
        drawn = kind.draw(shown)
        svg, _ = save(drawn.figure, folder, settings.name)
    return DrawnFigure(settings.name, shown.title, shown.caption, svg.read_text(encoding="utf-8"), drawn.marks)


def _curves(evaluation: AttributeEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield the learning curves of each method that is trained in epochs, with a line for each tested texture."""
    from palpate.modeling.training.history import history_in
    from palpate.modeling.training.trained_files import learning_curve

    for entry in evaluation.of(MAIN):
        histories = {
            f"without {done.job.test}": history
            for done in evaluation.results_of(entry)[:MOST]
            if not done.refused and (history := history_in(done.arrays))
        }
        if histories:
            name, title = f"learning_{entry.method}", f"Learning curves: {evaluation.method(entry).title}"
            last = not evaluation.method(entry).holds(evaluation.options.settings)
            with drawing(name):
                yield drawn_figure(name, title, words.CURVES, learning_curve(histories, last), folder)


def time_figures(rows: Sequence[Row], folder: Path) -> Iterator[DrawnFigure]:
    """Yield the figure of error against time, if methods were evaluated."""
    answered = [row for row in rows if row["mae"] is not None]
    if answered:
        with drawing("work_precision"):
            title = "Error against time"
            yield drawn_figure("work_precision", title, words.WORK_PRECISION, _time_panels(answered), folder)


def _time_panels(rows: Sequence[Row]) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import FuncFormatter, NullFormatter

    looks = [(COLOURS[i % len(COLOURS)], SHAPES[i // len(COLOURS) % len(SHAPES)]) for i in range(len(rows))]
    figure = Figure(figsize=(9.2, 4.0), layout="constrained")
    grid = figure.subplots(1, len(PANELS), sharey=True)
    for axes, (column, label) in zip(grid, PANELS, strict=True):
        for row, (colour, shape) in zip(rows, looks, strict=True):
            if row[column]:
                axes.plot([row[column]], [row["mae"]], shape, color=colour, markersize=6)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(label)
        axes.margins(x=0.1)
        axes.grid(visible=True)
    grid[0].set_ylabel("MAE, 0 to 100")
    grid[0].set_ylim(bottom=0)
    handles = [Line2D([], [], color=colour, marker=shape, linestyle="") for colour, shape in looks]
    figure.legend(handles, [row["title"] for row in rows], loc="outside upper left", frameon=False, ncols=3)
    return figure

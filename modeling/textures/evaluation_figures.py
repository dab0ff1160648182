"""Figures 4.5 to 4.7 of the thesis, and learning curves; those of running free and of time with them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.textures import evaluation_words as words
from palpate.modeling.textures.domain import Fit, Play
from palpate.modeling.textures.evaluation import TextureEvaluation
from palpate.modeling.textures.evaluation_figures_free import free_figures
from palpate.modeling.textures.evaluation_figures_time import time_figures
from palpate.modeling.textures.evaluation_panels import keyed, named, panels, spectrum
from palpate.modeling.textures.evaluation_tables import FIRST, WARM_UP, Row, figure_4_5, start_of, warm_up_rows
from palpate.modeling.textures.metrics import SMOOTHED
from palpate.modeling.textures.registry import DEFAULT, THESIS
from palpate.modeling.training.history import history_in
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from palpate.modeling.training.history import Epoch

CURVED = (DEFAULT, THESIS)


def figures(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Draw every figure that the evaluation has something for, and write NAME.svg and NAME.png into the folder."""
    yield from free_figures(evaluation, folder)
    yield from _grid(evaluation, folder)
    yield from _one_step(evaluation, folder)
    yield from time_figures(evaluation, folder)
    yield from _curves(evaluation, folder)


def _grid(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Figure 4.5."""
    rows = [row for row in figure_4_5(evaluation) if row["mae"] is not None]
    if rows:
        caption = words.FIGURE_4_5.format(count=max(row["textures"] for row in rows))
        with drawing("figure_4_5"):
            yield drawn_figure("figure_4_5", "Window and loss", caption, _grid_figure(rows), folder)


def _grid_figure(rows: list[Row]) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    losses = list(dict.fromkeys(row["loss"] for row in rows))
    for loss, colour in zip(losses, (INK, *OKABE_ITO), strict=False):
        line = [row for row in rows if row["loss"] == loss]
        axes.plot(
            [row["window"] for row in line], [row["mae"] for row in line], "o-", color=colour, label=loss, markersize=4
        )
    axes.set_xticks(sorted({row["window"] for row in rows}))
    named(axes, "window, samples", "MAE, SDs")
    axes.grid(visible=True, axis="y")
    figure.legend(loc="outside right upper", frameon=False)
    return figure


def _one_step(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Figures 4.6 and 4.7, of the thesis' method where it was evaluated, else of ours, else of the first; and the time
    domain of Figure 4.6 once more where that method runs free."""
    order = (THESIS, DEFAULT, *evaluation.options.names)
    name = next((each for each in order if each in evaluation.options.names and _told(evaluation, each)), None)
    if name is None:
        return
    told, title = _told(evaluation, name), evaluation.method(name).title
    colours = {"recorded": INK, title: OKABE_ITO[0 if name == DEFAULT else 1]}  # as where it runs free
    labels = {texture: evaluation.domain.recordings[texture].label for texture in told}
    errors = {texture: evaluation.fits[Fit(texture, name)].numbers.get("mae") for texture in told}
    titles = {texture: f"{labels[texture]} ({error:.2f})" for texture, error in errors.items() if error is not None}

    def waves(axes: Axes, texture: str) -> None:
        for signal, colour, width in zip(told[texture], colours.values(), (1.5, 0.8), strict=True):
            axes.plot(np.arange(len(signal[:FIRST])), signal[:FIRST], color=colour, linewidth=width)
        named(axes, "sample", "m/s²")

    def spectra(axes: Axes, texture: str) -> None:
        actual, answered = told[texture]
        spectrum(axes, [(actual, INK, 1.7), (answered, colours[title], 1.0)])

    long = [texture for texture in told if len(told[texture][0]) >= SMOOTHED]
    for number, textures, draw, height, what, caption in (
        ("4_6", list(told), waves, 1.7, "time", words.FIGURE_4_6),
        ("4_7", long, spectra, 2.1, "frequency", words.FIGURE_4_7),
    ):
        if textures:
            file, shown = f"figure_{number}", {**labels, **(titles if number == "4_6" else {})}
            with drawing(file):
                figure = keyed(panels(textures, shown, draw, height), colours)
                yield drawn_figure(file, f"One step ahead, in {what}", caption.format(title=title), figure, folder)
        if number == "4_6":
            yield from _free(evaluation, name, colours, folder)


def free_beginning(evaluation: TextureEvaluation, method: str) -> dict[str, tuple[Array, Array]]:
    """By texture: the truth and what the method makes on its own output, 400 samples from where the hand moves.

    Textures on which it did not run are left out.
    """
    made = {texture: evaluation.plays[Play(Fit(texture, method))] for texture in evaluation.drives}
    return {
        texture: (drive.truth[start_of(drive) :][:FIRST], made[texture].array("made")[start_of(drive) :][:FIRST])
        for texture, drive in evaluation.drives.items()
        if not made[texture].refused
    }


def _free(
    evaluation: TextureEvaluation, method: str, colours: Mapping[str, str], folder: Path
) -> Iterator[DrawnFigure]:
    told = free_beginning(evaluation, method)
    if not told:
        return
    levels = {row["texture"]: row for row in warm_up_rows(evaluation) if row["method"] == method}
    titles = {
        texture: f"{evaluation.domain.recordings[texture].label}"
        f" ({_ratio(levels[texture]['level_first_100'])}, {_ratio(levels[texture]['level_next_300'])})"
        for texture in told
    }

    def waves(axes: Axes, texture: str) -> None:
        for signal, colour, width in zip(told[texture], colours.values(), (1.5, 0.8), strict=True):
            axes.plot(np.arange(len(signal)), signal, color=colour, linewidth=width)
        axes.axvline(WARM_UP, color=SOFT, linewidth=0.7, linestyle=":")
        named(axes, "sample", "m/s²")

    hands = " or ".join(dict.fromkeys(evaluation.drives[texture].described for texture in told))
    with drawing("figure_4_6_free"):
        figure = keyed(panels(list(told), titles, waves, 1.7), colours)
        caption = words.FIGURE_4_6_FREE.format(hand=hands)
        yield drawn_figure("figure_4_6_free", "Running free, in time", caption, figure, folder)


def _ratio(level: float | None) -> str:
    return "silent" if level is None else f"{level:.2f}"


def _told(evaluation: TextureEvaluation, method: str) -> dict[str, tuple[Array, Array]]:
    """By texture: the test part, and what a method says of it."""
    done = {texture: evaluation.fits[Fit(texture, method)] for texture in evaluation.textures}
    return {name: (each.array("actual"), each.array("answered")) for name, each in done.items() if not each.refused}


def _curves(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """The learning curves of ours and of the thesis' method, a line for each texture."""
    from palpate.modeling.training.learning_curve import learning_curve

    for method in CURVED:
        if histories := _histories(evaluation, method):
            name, title = f"learning_{method}", f"Learning curves: {evaluation.method(method).title}"
            with drawing(name):
                yield drawn_figure(name, title, words.CURVES, learning_curve(histories), folder)


def _histories(evaluation: TextureEvaluation, method: str) -> dict[str, tuple[Epoch, ...]]:
    labels = {fit: evaluation.domain.recordings[fit.texture].label for fit in evaluation.fits}
    own = {
        labels[fit]: history_in(done.arrays) for fit, done in evaluation.fits.items() if fit == Fit(fit.texture, method)
    }
    return {label: history for label, history in own.items() if history}

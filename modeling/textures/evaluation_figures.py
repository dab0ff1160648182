"""Figures 4.5 to 4.7 of the thesis, and learning curves; those of running free and of time with them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.figures.style import INK, OKABE_ITO, drawing
from modeling.report.drawn import Pictured, drawn_figure
from modeling.textures import evaluation_words as words
from modeling.textures.evaluation_figures_free import free_figures
from modeling.textures.evaluation_figures_time import time_figures
from modeling.textures.evaluation_panels import keyed, named, panels, spectrum
from modeling.textures.evaluation_tables import Row, figure_4_5
from modeling.textures.judging_jobs import Fit
from modeling.textures.judging_whole import Judged
from modeling.textures.metrics import SMOOTHED
from modeling.textures.recording import Array
from modeling.textures.registry import DEFAULT, THESIS
from modeling.training.curves import history_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from modeling.training.history import Epoch

FIRST = 400
CURVED = (DEFAULT, THESIS)


def figures(found: Judged, folder: Path) -> Iterator[Pictured]:
    """Draw every figure that the evaluation has something for, and write NAME.svg and NAME.png into the folder."""
    yield from free_figures(found, folder)
    yield from _grid(found, folder)
    yield from _one_step(found, folder)
    yield from time_figures(found, folder)
    yield from _curves(found, folder)


def _grid(found: Judged, folder: Path) -> Iterator[Pictured]:
    """Figure 4.5."""
    rows = [row for row in figure_4_5(found) if row["mae"] is not None]
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


def _one_step(found: Judged, folder: Path) -> Iterator[Pictured]:
    """Figures 4.6 and 4.7, of the thesis' method where it was evaluated, else of ours, else of the first."""
    order = (THESIS, DEFAULT, *found.wanted.names)
    name = next((each for each in order if each in found.wanted.names and _told(found, each)), None)
    if name is None:
        return
    told, title = _told(found, name), found.method(name).title
    colours = {"recorded": INK, title: OKABE_ITO[0 if name == DEFAULT else 1]}  # as where it runs free
    labels = {texture: found.context.recordings[texture].label for texture in told}
    errors = {texture: found.fits[Fit(texture, name)].numbers.get("mae") for texture in told}
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
            name, shown = f"figure_{number}", {**labels, **(titles if number == "4_6" else {})}
            with drawing(name):
                figure = keyed(panels(textures, shown, draw, height), colours)
                yield drawn_figure(name, f"One step ahead, in {what}", caption.format(title=title), figure, folder)


def _told(found: Judged, method: str) -> dict[str, tuple[Array, Array]]:
    """By texture: the test part, and what a method says of it."""
    done = {texture: found.fits[Fit(texture, method)] for texture in found.textures}
    return {name: (each.array("actual"), each.array("answered")) for name, each in done.items() if not each.refused}


def _curves(found: Judged, folder: Path) -> Iterator[Pictured]:
    """The learning curves of ours and of the thesis' method, a line for each texture."""
    from modeling.training.learning_curve import learning_curve

    for method in CURVED:
        if histories := _histories(found, method):
            name, title = f"learning_{method}", f"Learning curves: {found.method(method).title}"
            with drawing(name):
                yield drawn_figure(name, title, words.CURVES, learning_curve(histories), folder)


def _histories(found: Judged, method: str) -> dict[str, tuple[Epoch, ...]]:
    labels = {fit: found.context.recordings[fit.texture].label for fit in found.fits}
    own = {labels[fit]: history_in(done.arrays) for fit, done in found.fits.items() if fit == Fit(fit.texture, method)}
    return {label: history for label, history in own.items() if history}

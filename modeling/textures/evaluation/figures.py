"""Figures 4.5 to 4.7 of the thesis, of free runs and of times, and learning curves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing, quiet_axes
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.textures.domain import Fit, Play
from palpate.modeling.textures.drive import Drive
from palpate.modeling.textures.evaluation import words
from palpate.modeling.textures.evaluation.evaluate import TextureEvaluation
from palpate.modeling.textures.evaluation.tables import (
    FIRST,
    TRUTH,
    WARM_UP,
    Row,
    figure_4_5,
    method_rows,
    start_of,
    warm_up_rows,
)
from palpate.modeling.textures.metrics import ENVELOPE_MS, SMOOTHED, density, envelope
from palpate.modeling.textures.recording import RATE_HZ
from palpate.modeling.textures.registry import BASELINE, DEFAULT, THESIS
from palpate.modeling.training.history import history_in
from palpate.signals.arrays import Array
from palpate.signals.textures.gate import sounds

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


CURVED = (DEFAULT, THESIS)
COLUMNS = 2
DEEP_DB, HIGH_DB = 45.0, 6.0
"""The range of a spectrum's axis below and above the truth's greatest density."""
Draw = Callable[["Axes", str], None]
MOST = 3
"""The most methods in one figure, beside the truth."""
FIRST_S = 20.0
"""Seconds of the envelopes that are shown."""
SHOWN = 250
"""Samples of the waves that are shown."""
COLOURS = (*OKABE_ITO, INK)
SHAPES = ("o", "s")
"""Markers of the first methods, and of those with the same colours again."""
Look = tuple[str, str]


def figures(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Draw every figure that the evaluation has data for, and write NAME.svg and NAME.png into the folder."""
    yield from free_figures(evaluation, folder)
    rows = [row for row in figure_4_5(evaluation) if row["mae"] is not None]
    if rows:
        caption = words.FIGURE_4_5.format(count=max(row["textures"] for row in rows))
        with drawing("figure_4_5"):
            yield drawn_figure("figure_4_5", "Window and loss", caption, _grid_figure(rows), folder)
    yield from _one_step(evaluation, folder)
    yield from time_figures(evaluation, folder)
    # the learning curves of ours and of the thesis' method, a line for each texture
    from palpate.modeling.training.trained_files import learning_curve

    for method in CURVED:
        histories = {
            evaluation.domain.recordings[fit.texture].label: history
            for fit, done in evaluation.fits.items()
            if fit == Fit(fit.texture, method) and (history := history_in(done.arrays))
        }
        if histories:
            name, title = f"learning_{method}", f"Learning curves: {evaluation.method(method).title}"
            with drawing(name):
                yield drawn_figure(name, title, words.CURVES, learning_curve(histories), folder)


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
    label_axes(axes, "window, samples", "MAE, SDs")
    axes.grid(visible=True, axis="y")
    figure.legend(loc="outside right upper", frameon=False)
    return figure


def _one_step(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield figures 4.6 and 4.7 of the thesis' method, else of the default, else of the first that was evaluated.

    Figure 4.6 is drawn once more for the free run of that method.
    """
    order = (THESIS, DEFAULT, *evaluation.options.names)
    name = next(
        (method for method in order if method in evaluation.options.names and _test_part(evaluation, method)), None
    )
    if name is None:
        return
    pairs, title = _test_part(evaluation, name), evaluation.method(name).title
    colours = {"recorded": INK, title: OKABE_ITO[0 if name == DEFAULT else 1]}  # as where it runs free
    labels = {texture: evaluation.domain.recordings[texture].label for texture in pairs}
    errors = {texture: evaluation.fits[Fit(texture, name)].numbers.get("mae") for texture in pairs}
    titles = {texture: f"{labels[texture]} ({error:.2f})" for texture, error in errors.items() if error is not None}

    def waves(axes: Axes, texture: str) -> None:
        for signal, colour, width in zip(pairs[texture], colours.values(), (1.5, 0.8), strict=True):
            axes.plot(np.arange(len(signal[:FIRST])), signal[:FIRST], color=colour, linewidth=width)
        label_axes(axes, "sample", "m/s²")

    def spectra(axes: Axes, texture: str) -> None:
        actual, answered = pairs[texture]
        spectrum(axes, [(actual, INK, 1.7), (answered, colours[title], 1.0)])

    long = [texture for texture in pairs if len(pairs[texture][0]) >= SMOOTHED]
    for number, textures, draw, height, what, caption in (
        ("4_6", list(pairs), waves, 1.7, "time", words.FIGURE_4_6),
        ("4_7", long, spectra, 2.1, "frequency", words.FIGURE_4_7),
    ):
        if textures:
            file, shown = f"figure_{number}", {**labels, **(titles if number == "4_6" else {})}
            with drawing(file):
                figure = add_legend(panels(textures, shown, draw, height), colours)
                yield drawn_figure(file, f"One step ahead, in {what}", caption.format(title=title), figure, folder)
        if number == "4_6":
            yield from _free(evaluation, name, colours, folder)


def free_beginning(evaluation: TextureEvaluation, method: str) -> dict[str, tuple[Array, Array]]:
    """Return by texture the truth and the method's own output, for 400 samples from where the hand starts to move.

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
    pairs = free_beginning(evaluation, method)
    if not pairs:
        return
    levels = {row["texture"]: row for row in warm_up_rows(evaluation) if row["method"] == method}
    titles = {
        texture: f"{evaluation.domain.recordings[texture].label}"
        f" ({_ratio(levels[texture]['level_first_100'])}, {_ratio(levels[texture]['level_next_300'])})"
        for texture in pairs
    }

    def waves(axes: Axes, texture: str) -> None:
        for signal, colour, width in zip(pairs[texture], colours.values(), (1.5, 0.8), strict=True):
            axes.plot(np.arange(len(signal)), signal, color=colour, linewidth=width)
        axes.axvline(WARM_UP, color=SOFT, linewidth=0.7, linestyle=":")
        label_axes(axes, "sample", "m/s²")

    hands = " or ".join(dict.fromkeys(evaluation.drives[texture].described for texture in pairs))
    with drawing("figure_4_6_free"):
        figure = add_legend(panels(list(pairs), titles, waves, 1.7), colours)
        caption = words.FIGURE_4_6_FREE.format(hand=hands)
        yield drawn_figure("figure_4_6_free", "Running free, in time", caption, figure, folder)


def _ratio(level: float | None) -> str:
    return "silent" if level is None else f"{level:.2f}"


def _test_part(evaluation: TextureEvaluation, method: str) -> dict[str, tuple[Array, Array]]:
    """Return by texture the test part and a method's predictions of it."""
    done = {texture: evaluation.fits[Fit(texture, method)] for texture in evaluation.textures}
    return {
        name: (result.array("actual"), result.array("answered")) for name, result in done.items() if not result.refused
    }


def panels(textures: Sequence[str], titles: Mapping[str, str], draw: Draw, height: float) -> Figure:
    """Return a figure with one panel for each texture in two columns, each `height` inches high."""
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(textures))
    lines = -(-len(textures) // columns)
    figure = Figure(figsize=(4.6 * columns + 1.0 * (columns == 1), height * lines + 0.5), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for panel, texture in zip(axes, textures, strict=False):
        draw(panel, texture)
        panel.set_title(titles[texture])
        quiet_axes(panel)
    for unused in axes[len(textures) :]:
        unused.set_axis_off()
    return figure


def add_legend(figure: Figure, colours: Mapping[str, str]) -> Figure:
    """Add a legend above the figure, and return it."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour) for colour in colours.values()]
    figure.legend(handles, list(colours), loc="outside upper left", frameon=False, ncols=len(colours))
    return figure


def label_axes(axes: Axes, along: str, up: str) -> None:
    """Label both axes with quantities and units."""
    axes.set_xlabel(along, color=SOFT, fontsize=8.0)
    axes.set_ylabel(up, color=SOFT, fontsize=8.0)


def spectrum(axes: Axes, lines: Sequence[tuple[Array, str, float]]) -> None:
    """Draw power spectral densities of signals (m/s^2) in dB with colours and widths; the first sets the range."""
    top = 10 * np.log10(max(float(density(lines[0][0])[1].max()), np.finfo(float).tiny))
    for signal, colour, width in lines:
        hertz, power = density(signal)
        decibels = 10 * np.log10(np.maximum(power, np.finfo(float).tiny))
        axes.plot(hertz[1:-1], np.maximum(decibels[1:-1], top - 2 * DEEP_DB), color=colour, linewidth=width)
    axes.set_ylim(top - DEEP_DB, top + HIGH_DB)
    label_axes(axes, "Hz", "dB re 1 (m/s²)²/Hz")


@dataclass(frozen=True)
class Line:
    """The drawn signals: the truth's and each method's by texture, with colours and labels."""

    drives: Mapping[str, Drive]
    made: Mapping[str, Mapping[str, Array]]
    colours: Mapping[str, str]
    labels: Mapping[str, str]

    def lines(self, texture: str) -> list[tuple[Array, str, float]]:
        """Return the signals of a texture, the truth first, with colour and width."""
        truth = (self.drives[texture].truth, self.colours[TRUTH], 1.7)
        return [truth, *((signal, self.colours[title], 1.0) for title, signal in self.made[texture].items())]


def free_figures(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield the figures of free runs of our method, the thesis' and the baseline: spectra, envelopes and waves."""
    shown = _free_running(evaluation)
    if not shown.made:
        return

    def spectra(axes: Axes, texture: str) -> None:
        spectrum(axes, shown.lines(texture))

    def envelopes(axes: Axes, texture: str) -> None:
        for signal, colour, width in shown.lines(texture):
            slowly = envelope(signal[: round(FIRST_S * RATE_HZ)])
            axes.plot(np.arange(len(slowly)) * ENVELOPE_MS / 1000, slowly, color=colour, linewidth=0.7 * width)
        axes.locator_params(axis="x", nbins=5, integer=True)
        label_axes(axes, "s", "m/s²")

    yield _panel_figure("free_spectra", ("Running free: spectra", words.FREE_SPECTRA), shown, spectra, folder)
    yield _panel_figure("free_envelopes", ("Running free: envelopes", words.ENVELOPES), shown, envelopes, folder)
    with drawing("free_waves"):
        yield drawn_figure("free_waves", "Running free: waves", words.FREE_WAVES, _waves(shown), folder)


def _panel_figure(name: str, title_and_caption: tuple[str, str], shown: Line, draw: Draw, folder: Path) -> DrawnFigure:
    title, caption = title_and_caption
    with drawing(name):
        figure = add_legend(panels(list(shown.made), shown.labels, draw, 2.1), shown.colours)
        return drawn_figure(name, title, caption, figure, folder)


def _free_running(evaluation: TextureEvaluation) -> Line:
    order = dict.fromkeys((DEFAULT, THESIS, BASELINE, *evaluation.options.names))
    names = [name for name in order if name in evaluation.options.names][:MOST]
    titles = {name: evaluation.method(name).title for name in names}
    made: dict[str, dict[str, Array]] = {}
    for texture in evaluation.drives:
        ran = {title: evaluation.plays[Play(Fit(texture, name))] for name, title in titles.items()}
        whole = {title: done.array("made").astype(np.float64) for title, done in ran.items() if not done.refused}
        made |= {texture: whole} if whole else {}
    colours = {TRUTH: INK, **dict(zip(titles.values(), OKABE_ITO, strict=False))}
    return Line(
        evaluation.drives,
        made,
        colours,
        {name: recording.label for name, recording in evaluation.domain.recordings.items()},
    )


def _waves(shown: Line) -> Figure:
    """Return a row for each texture, a column for the truth and each method, one scale in a row."""
    from matplotlib.figure import Figure

    titles = list(shown.colours)
    figure = Figure(figsize=(2.4 * len(titles) + 0.6, 1.15 * len(shown.made) + 0.5), layout="constrained")
    axes = figure.subplots(len(shown.made), len(titles), squeeze=False, sharex=True, sharey="row")
    for row, texture in zip(axes, shown.made, strict=True):
        start = _steady_start(shown.drives[texture])
        signals = {TRUTH: shown.drives[texture].truth, **shown.made[texture]}
        for panel, title in zip(row, titles, strict=True):
            if title in signals:
                wave = signals[title][start : start + SHOWN]
                panel.plot(np.arange(len(wave)) / RATE_HZ, wave, color=shown.colours[title], linewidth=0.8)
            panel.set_xticks([])
            panel.tick_params(labelsize=7)
        row[0].set_ylabel(shown.labels[texture].replace(" ", "\n"), color=SOFT, fontsize=8)
    for panel, title in zip(axes[0], titles, strict=True):
        panel.set_title(title)
    return figure


def _steady_start(drive: Drive) -> int:
    """Return the middle of the longest stretch in which the hand moves, with room for the drawn samples."""
    moving = np.r_[False, sounds(drive.speed, drive.force), False]
    edges = np.flatnonzero(np.diff(moving.astype(int)))
    stretches = list(zip(edges[::2], edges[1::2], strict=True))
    if not stretches:
        return 0
    start, stop = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
    return max(0, min(int(start + stop) // 2, len(drive.truth) - SHOWN))


def time_figures(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Yield the work-precision figure where methods ran free and a step or a training was timed."""
    rows = [row for row in method_rows(evaluation) if row["felt_dB"] is not None]
    if any(row["step_us"] or row["train_s"] for row in rows):
        with drawing("work_precision"):
            from matplotlib.figure import Figure
            from matplotlib.lines import Line2D

            looks = {row["method"]: (COLOURS[i % 8], SHAPES[i // 8 % 2]) for i, row in enumerate(rows)}
            figure = Figure(figsize=(9.2, 3.6), layout="constrained")
            step, training = figure.subplots(1, 2, sharey=True)
            for row in rows:
                medians = [median for median, _, _ in evaluation.steps.get(row["method"], {}).values()]
                _points(step, medians, row["felt_dB"], looks[row["method"]])
                _points(training, [row["train_s"]] if row["train_s"] else [], row["felt_dB"], looks[row["method"]])
            _label_log_axes(step, "a step, µs (median)", "felt levels off, dB")
            _label_log_axes(training, "training of a texture, s", "")
            step.set_ylim(bottom=0)
            handles = [Line2D([], [], color=colour, marker=shape, linestyle="") for colour, shape in looks.values()]
            figure.legend(handles, [row["title"] for row in rows], loc="outside upper left", frameon=False, ncols=3)
            yield drawn_figure("work_precision", "Error against time", words.WORK_PRECISION, figure, folder)


def _points(axes: Axes, times: list[float], error: float, look: Look) -> None:
    """Draw the fastest time as a filled point and the others as open ones, with a line between them."""
    colour, shape = look
    for i, time in enumerate(sorted(times)):
        face = colour if i == 0 else "white"
        axes.plot([time], [error], shape, color=colour, markerfacecolor=face, markersize=6, zorder=3)
    axes.plot(sorted(times), [error] * len(times), color=colour, linewidth=0.8)


def _label_log_axes(axes: Axes, along: str, up: str) -> None:
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.08)
    axes.grid(visible=True)
    label_axes(axes, along, up)

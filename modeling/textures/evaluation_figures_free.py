"""What models make on their own output, beside the truth: spectra, envelopes, waves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing
from palpate.analysis.reports.figures import DrawnFigure, drawn_figure
from palpate.modeling.textures import evaluation_words as words
from palpate.modeling.textures.domain import Fit, Play
from palpate.modeling.textures.drive import FAINTEST_N, SLOWEST_MM_S, Drive
from palpate.modeling.textures.evaluation import TextureEvaluation
from palpate.modeling.textures.evaluation_panels import Draw, keyed, named, panels, spectrum
from palpate.modeling.textures.evaluation_tables import TRUTH
from palpate.modeling.textures.metrics_running import ENVELOPE_MS, envelope
from palpate.modeling.textures.recording import RATE_HZ
from palpate.modeling.textures.registry import BASELINE, DEFAULT, THESIS
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 3
"""Methods in one figure beside the truth."""
FIRST_S = 20.0
"""Seconds of the envelopes that are shown."""
SHOWN = 250
"""Samples of the waves that are shown."""


@dataclass(frozen=True)
class Shown:
    """What is drawn: the truth's and each method's signal by texture, and a colour for each."""

    drives: Mapping[str, Drive]
    made: Mapping[str, Mapping[str, Array]]
    colours: Mapping[str, str]
    labels: Mapping[str, str]

    def lines(self, texture: str) -> list[tuple[Array, str, float]]:
        """The signals of a texture, the truth first, with colour and width."""
        truth = (self.drives[texture].truth, self.colours[TRUTH], 1.7)
        return [truth, *((each, self.colours[title], 1.0) for title, each in self.made[texture].items())]


def free_figures(evaluation: TextureEvaluation, folder: Path) -> Iterator[DrawnFigure]:
    """Three figures of ours, the thesis' and the baseline, as far as they ran."""
    shown = _shown(evaluation)
    if not shown.made:
        return

    def spectra(axes: Axes, texture: str) -> None:
        spectrum(axes, shown.lines(texture))

    def envelopes(axes: Axes, texture: str) -> None:
        for signal, colour, width in shown.lines(texture):
            slowly = envelope(signal[: round(FIRST_S * RATE_HZ)])
            axes.plot(np.arange(len(slowly)) * ENVELOPE_MS / 1000, slowly, color=colour, linewidth=0.7 * width)
        axes.locator_params(axis="x", nbins=5, integer=True)
        named(axes, "s", "m/s²")

    yield _panelled("free_spectra", ("Running free: spectra", words.FREE_SPECTRA), shown, spectra, folder)
    yield _panelled("free_envelopes", ("Running free: envelopes", words.ENVELOPES), shown, envelopes, folder)
    with drawing("free_waves"):
        yield drawn_figure("free_waves", "Running free: waves", words.FREE_WAVES, _waves(shown), folder)


def _panelled(name: str, told: tuple[str, str], shown: Shown, draw: Draw, folder: Path) -> DrawnFigure:
    title, caption = told
    with drawing(name):
        figure = keyed(panels(list(shown.made), shown.labels, draw, 2.1), shown.colours)
        return drawn_figure(name, title, caption, figure, folder)


def _shown(evaluation: TextureEvaluation) -> Shown:
    order = dict.fromkeys((DEFAULT, THESIS, BASELINE, *evaluation.options.names))
    names = [name for name in order if name in evaluation.options.names][:MOST]
    titles = {name: evaluation.method(name).title for name in names}
    made: dict[str, dict[str, Array]] = {}
    for texture in evaluation.drives:
        ran = {title: evaluation.plays[Play(Fit(texture, name))] for name, title in titles.items()}
        whole = {title: done.array("made").astype(np.float64) for title, done in ran.items() if not done.refused}
        made |= {texture: whole} if whole else {}
    colours = {TRUTH: INK, **dict(zip(titles.values(), OKABE_ITO, strict=False))}
    return Shown(
        evaluation.drives, made, colours, {name: each.label for name, each in evaluation.domain.recordings.items()}
    )


def _waves(shown: Shown) -> Figure:
    """A row for each texture, a column for the truth and each method, one scale in a row."""
    from matplotlib.figure import Figure

    titles = list(shown.colours)
    figure = Figure(figsize=(2.4 * len(titles) + 0.6, 1.15 * len(shown.made) + 0.5), layout="constrained")
    axes = figure.subplots(len(shown.made), len(titles), squeeze=False, sharex=True, sharey="row")
    for row, texture in zip(axes, shown.made, strict=True):
        start = _moving(shown.drives[texture])
        signals = {TRUTH: shown.drives[texture].truth, **shown.made[texture]}
        for each, title in zip(row, titles, strict=True):
            if title in signals:
                wave = signals[title][start : start + SHOWN]
                each.plot(np.arange(len(wave)) / RATE_HZ, wave, color=shown.colours[title], linewidth=0.8)
            each.set_xticks([])
            each.tick_params(labelsize=7)
        row[0].set_ylabel(shown.labels[texture].replace(" ", "\n"), color=SOFT, fontsize=8)
    for each, title in zip(axes[0], titles, strict=True):
        each.set_title(title)
    return figure


def _moving(drive: Drive) -> int:
    """Where the hand has moved steadily for the longest before: the middle of its longest stretch of moving."""
    moving = np.r_[False, (drive.speed > SLOWEST_MM_S) & (drive.force > FAINTEST_N), False]
    edges = np.flatnonzero(np.diff(moving.astype(int)))
    stretches = list(zip(edges[::2], edges[1::2], strict=True))
    if not stretches:
        return 0
    start, stop = max(stretches, key=lambda each: each[1] - each[0])
    return max(0, min(int(start + stop) // 2, len(drive.truth) - SHOWN))

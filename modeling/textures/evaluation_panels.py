"""Figures of one panel for each texture, with one key for all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.analysis.figures.style import SOFT, quiet_axes
from palpate.modeling.textures.metrics import density
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 2
DEEP_DB, HIGH_DB = 45.0, 6.0
"""Below and above the truth's greatest density: what lies beyond is not shown."""
Draw = Callable[["Axes", str], None]


def panels(textures: Sequence[str], titles: Mapping[str, str], draw: Draw, height: float) -> Figure:
    """One panel for each texture, two beside each other, each so many inches high."""
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(textures))
    lines = -(-len(textures) // columns)
    figure = Figure(figsize=(4.6 * columns + 1.0 * (columns == 1), height * lines + 0.5), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False).ravel()
    for each, texture in zip(axes, textures, strict=False):
        draw(each, texture)
        each.set_title(titles[texture])
        quiet_axes(each)
    for each in axes[len(textures) :]:
        each.set_axis_off()
    return figure


def keyed(figure: Figure, colours: Mapping[str, str]) -> Figure:
    """The figure with a key above."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=colour) for colour in colours.values()]
    figure.legend(handles, list(colours), loc="outside upper left", frameon=False, ncols=len(colours))
    return figure


def named(axes: Axes, along: str, up: str) -> None:
    """Both axes with their units, small."""
    axes.set_xlabel(along, color=SOFT, fontsize=8.0)
    axes.set_ylabel(up, color=SOFT, fontsize=8.0)


def spectrum(axes: Axes, lines: Sequence[tuple[Array, str, float]]) -> None:
    """Power spectral densities of signals (m/s^2) in dB, each with a colour and a width; the first decides how deep."""
    top = 10 * np.log10(max(float(density(lines[0][0])[1].max()), np.finfo(float).tiny))
    for signal, colour, width in lines:
        hertz, power = density(signal)
        decibels = 10 * np.log10(np.maximum(power, np.finfo(float).tiny))
        axes.plot(hertz[1:-1], np.maximum(decibels[1:-1], top - 2 * DEEP_DB), color=colour, linewidth=width)
    axes.set_ylim(top - DEEP_DB, top + HIGH_DB)
    named(axes, "Hz", "dB re 1 (m/s²)²/Hz")

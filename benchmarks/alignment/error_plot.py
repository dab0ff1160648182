"""A plot of the error of every method against the frequency of the aligned signal, with a panel for each rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.alignment.truth import GRID_HZ, KINDS
from palpate.protocols.files import open_bytes
from palpate.signals.aligning.methods import METHODS
from palpate.signals.aligning.sine_errors import HAND_HZ, sine_error

COLOURS = {
    "hold": "#999999", "nearest": "#56b4e9", "linear": "#e69f00", "pchip": "#009e73", "cubic": "#0072b2",
    "bandlimited": "#d55e00",
}  # fmt: skip
"""Okabe and Ito's colours, which colour-blind people can distinguish."""


def save_error_plot(path: Path, points: int) -> Path:
    """Draw the RMS error of a sine in percent against its frequency up to 40 Hz, as a PNG."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, panels = plt.subplots(1, len(KINDS), figsize=(13, 4.2), sharey=True, layout="constrained")
    hz = np.geomspace(1, 40, points)
    for panel, kind in zip(panels, KINDS, strict=True):
        for name in METHODS:
            representable = hz[hz < kind.rate_hz / 2.05]
            errors = [100 * sine_error(name, kind.rate_hz, GRID_HZ, float(frequency)) for frequency in representable]
            panel.loglog(representable, errors, color=COLOURS[name], label=name, linewidth=1.8)
        panel.axvline(HAND_HZ, color="black", linewidth=0.8, linestyle=":")
        panel.axhline(0.5, color="black", linewidth=0.8, linestyle=":")
        panel.set(title=f"from {kind.name}", xlabel="Hz", xlim=(1, 40), ylim=(1e-5, 300))
        panel.set_xticks([1, 2, 5, 10, 25], ["1", "2", "5", "10", "25"], minor=False)
        panel.minorticks_off()
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("RMS error of a sine, percent")
    panels[0].legend(frameon=False, loc="upper left", fontsize=9, ncols=2)
    figure.suptitle(
        "Onto 1 kHz: error by method, without vibration that folds down (dotted: 25 Hz, the fastest hand; 0.5 %)",
        fontsize=11,
    )
    with open_bytes(path) as file:
        figure.savefig(file, format=path.suffix[1:], dpi=130)
    plt.close(figure)
    return path

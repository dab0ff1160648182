"""Figures 3.5 and 3.6 of the thesis for a recorded texture: vibration with its spectrum, and segments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from palpate.analysis.features.touch import CONTACT_N, RATE_HZ, SEGMENT, SEGMENT_S, Touch, contact, segments
from palpate.analysis.figures.style import FAINT, INK, OKABE_ITO, SOFT, drawing, quiet_axes, save
from palpate.analysis.reports.csv_files import csv_text
from palpate.modeling.attributes.reading_touch import filtering, recorded, touch_of
from palpate.modeling.textures.preparing import UP, Touched
from palpate.modeling.textures.reading_ledgers import SIMULATED, touched_in
from palpate.protocols.files import staged_files, write_text
from palpate.signals.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 1200
"""Columns of a line's envelope: a longer line is drawn as its minimum and maximum in each column."""
AXES = ("x", "y", "z")
UNIT = "m/s²"
Row: TypeAlias = dict[str, Any]


@dataclass(frozen=True)
class Explored:
    """One exploration of a texture: its raw signals, its filtered signals, and the second at which both begin."""

    label: str
    touched: Touched
    touch: Touch
    begins_s: float
    notes: tuple[str, ...]


def draw_signals(lab: Path, texture: str, folder: Path, seconds: float) -> tuple[list[Path], tuple[str, ...]]:
    """Draw Figures 3.5 and 3.6 of a captured texture, the second one `seconds` long; return the files and notes.

    Raises TextureDataError where the texture was not captured, or its recording cannot be used.
    """
    explored = explored_texture(lab, texture)
    label = "" if explored.label == texture else f", {explored.label}"
    name = f"{texture}{label}{' (simulated)' if SIMULATED in explored.notes else ''}"
    files: list[str] = []
    with staged_files(folder) as draft:
        for file, rows, draw in (
            ("figure_3_5", vibration_rows(explored), _vibration_figure),
            ("figure_3_6", segment_rows(explored, seconds), _segment_figure),
        ):
            with drawing(file):
                files += [path.name for path in save(draw(rows, name), draft, file)]
            files.append(write_text(draft / f"{file}.csv", csv_text(rows)).name)
    return [folder / file for file in files], explored.notes


def explored_texture(lab: Path, texture: str) -> Explored:
    """Return the first exploration of a texture that a lab's sessions captured, filtered as for the models of touch.

    Raises TextureDataError as `draw_signals` does.
    """
    (captured,) = recorded(lab, [texture])
    first = captured.captures[0]
    touched = next(iter(touched_in(first, UP, first.path.name)))
    touch, notes = touch_of(texture, [touched], filtering())
    several = len(captured.captures)
    also = (f"the first of {several} captures is drawn",) if several > 1 else ()
    every = (touched.acceleration, touched.force, touched.speed, touched.position)
    begins_s = max(signal.times_s[0] for signal in every if signal is not None)
    return Explored(captured.label, touched, touch, float(begins_s), (*notes, *also))


def vibration_rows(explored: Explored) -> list[Row]:
    """Return the rows of Figure 3.5: each axis as recorded, all on one axis (DFT321), and the power over frequency.

    `shows` is x, y, z, one axis (`low` and `high` in m/s^2 from `time_s` on) or spectrum (`power` in (m/s^2)^2/Hz).
    """
    from scipy.signal import periodogram

    raw, felt = explored.touched.acceleration, segments(explored.touch)
    pressed = contact(explored.touch)
    rows: list[Row] = []
    for axis, values in zip(AXES, raw.values.T, strict=False):
        rows += _envelope(axis, raw.times_s - explored.begins_s, values)
    starts_s = _starts_s(explored.touch)
    times_s = (starts_s[:, None] + np.arange(SEGMENT) / RATE_HZ).ravel()
    rows += _envelope("one axis", times_s, felt.vibration.ravel())
    # the mean power spectral density of segments (s, 500), each under Hann's window
    hertz, density = periodogram(felt.vibration[pressed], RATE_HZ, window="hann", detrend=False, axis=-1)
    power = density.mean(axis=0)
    rows += [
        {"shows": "spectrum", "time_s": None, "low": None, "high": None, "hz": float(f), "power": float(p)}
        for f, p in zip(hertz, power, strict=True)
    ]
    return rows


def segment_rows(explored: Explored, seconds: float) -> list[Row]:
    """Return the rows of Figure 3.6, of the first `seconds` that were not trimmed.

    `shows` is acceleration (m/s^2, one axis), speed (mm/s) or force (N) with `low` and `high` from `time_s` on; or
    segment, from `time_s` to `until_s`, with whether the tool was in `contact`.
    """
    felt, pressed, starts_s = segments(explored.touch), contact(explored.touch), _starts_s(explored.touch)
    shown = starts_s < starts_s[0] + seconds - SEGMENT_S / 2
    times_s = (starts_s[shown, None] + np.arange(SEGMENT) / RATE_HZ).ravel()
    rows: list[Row] = []
    for shows, values in (("acceleration", felt.vibration), ("speed", felt.speed_mm_s), ("force", felt.force_N)):
        rows += _envelope(shows, times_s, values[shown].ravel())
    rows += [
        {"shows": "segment", "time_s": float(start), "until_s": float(start) + SEGMENT_S, "contact": bool(touches)}
        for start, touches in zip(starts_s[shown], pressed[shown], strict=True)
    ]
    return rows


def _starts_s(touch: Touch) -> Array:
    """Return the start of each segment, (segments,), in seconds since the first time that all signals have."""
    starts = [stretch.first + np.arange(0, len(stretch.axes) - SEGMENT + 1, SEGMENT) for stretch in touch.stretches]
    return np.asarray(np.concatenate(starts) / RATE_HZ)


def _envelope(shows: str, times_s: Array, values: Array) -> Iterator[Row]:
    """Yield rows with a line's minimum and maximum in each column; for a short line, every point."""
    step = max(1, len(values) // COLUMNS)
    for at in range(0, len(values), step):
        piece = values[at : at + step]
        known = piece[np.isfinite(piece)]
        low, high = (float(known.min()), float(known.max())) if known.size else (None, None)
        yield {"shows": shows, "time_s": float(times_s[at]), "low": low, "high": high}


def _vibration_figure(rows: Sequence[Row], name: str) -> Figure:
    from matplotlib.figure import Figure

    axes_shown = [axis for axis in AXES if any(row["shows"] == axis for row in rows)]
    figure = Figure(figsize=(7.2, 1.35 * len(axes_shown) + 3.6), layout="constrained")
    heights = [1.0] * (len(axes_shown) + 1) + [1.6]
    panels = figure.subplots(len(heights), 1, height_ratios=heights)
    for panel, shows in zip(panels, (*axes_shown, "one axis"), strict=False):
        title = "on one axis (DFT321), filtered" if shows == "one axis" else f"{shows}, as recorded"
        _band(panel, rows, shows, OKABE_ITO[1] if shows == "one axis" else INK, title, UNIT)
        panel.sharex(panels[0])
        panel.tick_params(labelbottom=panel is panels[-2])
    panels[-2].set_xlabel("time in s", color=SOFT)
    spectrum = [row for row in rows if row["shows"] == "spectrum"][1:-1]
    decibels = 10 * np.log10(np.maximum([row["power"] for row in spectrum], np.finfo(float).tiny))
    panels[-1].plot([row["hz"] for row in spectrum], decibels, color=OKABE_ITO[1], linewidth=1.2)
    _titled(panels[-1], "power over frequency, of the one axis", "dB re 1 (m/s²)²/Hz")
    panels[-1].set_xlim(0, RATE_HZ / 2)
    panels[-1].set_xlabel("Hz", color=SOFT)
    figure.align_ylabels(panels)
    figure.suptitle(name, x=0.01, ha="left", fontsize=10)
    return figure


def _segment_figure(rows: Sequence[Row], name: str) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 5.2), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    cuts = [row for row in rows if row["shows"] == "segment"]
    for panel, shows, title, unit, colour in zip(
        panels, ("acceleration", "speed", "force"), ("acceleration, one axis", "scanning speed", "normal force"),
        (UNIT, "mm/s", "N"), (INK, *OKABE_ITO[:2]), strict=True,
    ):  # fmt: skip
        _band(panel, rows, shows, colour, title, unit)
        for edge in sorted({row[end] for row in cuts for end in ("time_s", "until_s")}):
            panel.axvline(edge, color=SOFT, linewidth=0.6, linestyle=":", zorder=0)
        for row in (row for row in cuts if not row["contact"]):
            panel.axvspan(row["time_s"], row["until_s"], color=FAINT, linewidth=0, zorder=0)
    panels[-1].set_xlim(cuts[0]["time_s"], cuts[-1]["until_s"])
    panels[-1].set_xlabel("time in s", color=SOFT)
    figure.align_ylabels(panels)
    lifted = f"; grey: mean force below {CONTACT_N:g} N" if not all(row["contact"] for row in cuts) else ""
    figure.suptitle(f"{name}: segments of {SEGMENT_S:g} s{lifted}", x=0.01, ha="left", fontsize=10)
    return figure


def _band(panel: Axes, rows: Sequence[Row], shows: str, colour: str, title: str, unit: str) -> None:
    """Draw a line as the band between its minimum and maximum in each column, with gaps for missing values."""
    own = [row for row in rows if row["shows"] == shows]
    times = [row["time_s"] for row in own]
    low, high = (np.array([row[end] for row in own], dtype=float) for end in ("low", "high"))
    panel.fill_between(times, low, high, color=colour, linewidth=0.7)
    panel.margins(x=0)
    _titled(panel, title, unit)


def _titled(panel: Axes, title: str, unit: str) -> None:
    panel.set_title(title, fontsize=9, fontweight="normal")
    panel.set_ylabel(unit, color=SOFT)
    quiet_axes(panel)

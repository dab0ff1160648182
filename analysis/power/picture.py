"""The power curve as a figure and as a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from palpate.analysis.figures.style import INK, OKABE_ITO, SOFT, drawing, quiet_axes, save
from palpate.analysis.power.curve import Asking, Point
from palpate.analysis.reports.csv_files import csv_text
from palpate.protocols.files import staged_files, write_text


def write_curve(points: Sequence[Point], asking: Asking, wanted: float, folder: Path) -> list[Path]:
    """Write power_TEST_xEFFECT.csv, .svg and .png to `folder` and give the paths; other questions have other names."""
    what = re.sub(r"[^\w.]+", "-", "_".join(filter(None, (asking.test, asking.outcome, asking.row, asking.column))))
    name = f"power_{what}_x{asking.effect:g}"
    asked = ("test", "outcome", "row", "column", "effect", "alpha", "seed")
    rows = [{**asdict(point), **{key: getattr(asking, key) for key in asked}} for point in points]
    with staged_files(folder) as draft:
        paths = [write_text(draft / f"{name}.csv", csv_text(rows)), *_drawn(points, asking, wanted, draft, name)]
    return [folder / path.name for path in paths]


def _drawn(points: Sequence[Point], asking: Asking, wanted: float, folder: Path, name: str) -> list[Path]:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    with drawing(name):
        figure = Figure(figsize=(5.6, 3.4), layout="constrained")
        axes = figure.subplots()
        sizes = [point.participants for point in points]
        low, high = [point.low for point in points], [point.high for point in points]
        axes.fill_between(sizes, low, high, color=OKABE_ITO[0], alpha=0.18, linewidth=0)
        axes.plot(
            sizes, [point.power for point in points], color=OKABE_ITO[0], marker="o", markersize=4.5, linewidth=1.6
        )
        axes.axhline(wanted, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.text(sizes[-1], wanted, f"wanted: {wanted:g}", ha="right", va="bottom", fontsize=8, color=SOFT)
        axes.set_ylim(0, 1.02)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("participants", color=INK)
        axes.set_ylabel(f"share of {points[0].runs} runs with p ≤ {asking.alpha:g}")
        asked = " ".join(filter(None, (asking.test, asking.outcome)))
        axes.set_title(f"{asked} ({points[-1].by or 'no p'}), effect × {asking.effect:g}")
        quiet_axes(axes)
        return save(figure, folder, name)

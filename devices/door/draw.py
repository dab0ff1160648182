"""A picture of a stimulus folder: one row per door, one column per augmentation, like Figure 5.7 of the thesis."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from devices.door.grid import MAX_ANGLE_DEG, POINTS, DoorDataError, grid_angle_deg
from devices.door.twin import read_profile
from protocols.files import open_bytes

NEEDED = ("car", "variant", "augmentation", "source", "file")
FORMATS = ("png", "svg", "pdf")
COLOURS = ("#0072b2", "#d55e00", "#009e73")
"""Three that stay apart for colour-blind readers (Okabe and Ito)."""


def draw(folder: Path, out: Path) -> Path:
    """Draw every profile of the folder's stimuli.csv; each panel shows the door's original in grey.

    Raises:
        DoorDataError: a table without the needed columns, or a profile that cannot be read.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    form = out.suffix[1:].lower()
    if form not in FORMATS:
        raise DoorDataError(f"{out}: a picture is written as {', '.join(f'.{name}' for name in FORMATS)}.")

    rows = _table(folder / "stimuli.csv")
    cars = list(dict.fromkeys(row["car"] for row in rows))
    kinds = [kind for kind in dict.fromkeys(row["augmentation"] for row in rows) if kind != "original"] or ["original"]
    figure = Figure(figsize=(2.7 * len(kinds), 1.75 * len(cars) + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(cars), len(kinds), sharex=True, sharey=True, squeeze=False)
    for car, line in zip(cars, panels, strict=True):
        for kind, panel in zip(kinds, line, strict=True):
            _panel(panel, folder, [row for row in rows if row["car"] == car], kind)
    _label(panels, rows, cars, kinds)
    with open_bytes(out) as file:
        figure.savefig(file, format=form, dpi=110, metadata={"Software": None} if form == "png" else None)
    return out


def _table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8-sig", newline="") as lines:
        rows = list(csv.DictReader(lines))
    missing = [name for name in NEEDED if not rows or name not in rows[0]]
    if missing:
        raise DoorDataError(f"{path}: column {', '.join(missing)} missing, or no rows; `palpate doors make` writes it.")
    return rows


def _panel(panel: Any, folder: Path, rows: list[dict[str, str]], kind: str) -> None:
    angles = [grid_angle_deg(index) for index in range(POINTS)]
    panel.axhline(0, color="0.85", linewidth=0.6)
    for row in (row for row in rows if row["augmentation"] == "original"):
        panel.plot(angles, read_profile(folder / row["file"]), color="0.65", linewidth=2.2)
    variants = [row for row in rows if row["augmentation"] == kind and kind != "original"]
    for number, row in enumerate(variants):
        colour = COLOURS[number % len(COLOURS)]
        panel.plot(angles, read_profile(folder / row["file"]), color=colour, linewidth=0.9, label=row["variant"])
    if variants:
        panel.legend(fontsize=6, frameon=False, ncols=3, loc="upper right", handlelength=1, columnspacing=0.8)
    panel.set_xlim(0, MAX_ANGLE_DEG)
    panel.tick_params(labelsize=7)


def _label(panels: Any, rows: list[dict[str, str]], cars: list[str], kinds: list[str]) -> None:
    sources = {row["car"]: row["source"] for row in rows}
    bottom, top = panels[0, 0].get_ylim()
    panels[0, 0].set_ylim(bottom, top + 0.12 * (top - bottom))
    for car, line in zip(cars, panels, strict=True):
        line[0].set_ylabel(f"{car} ({sources[car]})\nforce in N", fontsize=7)
    for kind, panel in zip(kinds, panels[0], strict=True):
        panel.set_title(kind, fontsize=8)
    for panel in panels[-1]:
        panel.set_xlabel("angle in degrees", fontsize=7)

"""Pictures of a stimulus folder, as Figures 5.3, 5.6 and 5.7 of the thesis, and the numbers of the first two."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.door.recording import read_columns
from palpate.devices.picture import COLOURS, FAINT, INK, SOFT, drawing, write_picture
from palpate.protocols.tables import TableFormat, read_table
from palpate.protocols.wording import some
from palpate.signals.arrays import Array
from palpate.signals.doors.features import landmarks, plateau_of
from palpate.signals.doors.grid import MAX_ANGLE_DEG, POINTS, DoorDataError, grid_angle_deg
from palpate.signals.doors.profile_file import read_profile

NEEDED = ("car", "variant", "augmentation", "source", "file")
STIMULI = TableFormat(error=DoorDataError, unreadable=None, width=None)
ANGLES = [grid_angle_deg(index) for index in range(POINTS)]
ACROSS = 3
ROOM = 0.28
"""Room for text above the highest force, as a share of the range of all forces."""
Row = dict[str, Any]


def draw(folder: Path, out: Path) -> list[Path]:
    """Draw every profile of the folder's stimuli.csv; each panel shows the door's original in grey (Figure 5.7).

    Raises:
        DoorDataError: a table without the required columns, or a profile that cannot be read.
        PictureError: `out` does not end as a picture's name.
    """
    from matplotlib.figure import Figure

    rows = _table(folder / "stimuli.csv")
    cars = list(dict.fromkeys(row["car"] for row in rows))
    kinds = [kind for kind in dict.fromkeys(row["augmentation"] for row in rows) if kind != "original"] or ["original"]
    with drawing("doors"):
        figure = Figure(figsize=(2.7 * len(kinds), 1.75 * len(cars) + 0.4), layout="constrained")
        panels = figure.subplots(len(cars), len(kinds), sharex=True, sharey=True, squeeze=False)
        for car, line in zip(cars, panels, strict=True):
            for kind, panel in zip(kinds, line, strict=True):
                _panel(panel, folder, [row for row in rows if row["car"] == car], kind)
        _label(panels, rows, cars, kinds)
        return write_picture(figure, out)


def draw_features(folder: Path, out: Path) -> list[Path]:
    """Draw each door's original with its peaks, the angles between them, slopes and plateau (Figure 5.6).

    Raises as `draw` does.
    """
    from matplotlib.figure import Figure

    rows = feature_rows(_originals(folder))
    cars = list(dict.fromkeys(row["car"] for row in rows))
    with drawing("features"):
        lines = -(-len(cars) // ACROSS)
        figure = Figure(figsize=(3.5 * min(ACROSS, len(cars)), 2.5 * lines + 0.4), layout="constrained")
        panels = figure.subplots(lines, min(ACROSS, len(cars)), sharex=True, sharey=True, squeeze=False)
        for car, panel in zip(cars, panels.ravel(), strict=False):
            _features(panel, car, [row for row in rows if row["car"] == car])
        for panel in panels.ravel()[len(cars) :]:
            panel.set_axis_off()
        bottom, top = panels[0, 0].get_ylim()
        panels[0, 0].set_ylim(bottom, top + ROOM * (top - bottom))
        figure.supxlabel("angle in degrees", fontsize=9, color=SOFT)
        figure.supylabel("force in N", fontsize=9, color=SOFT)
        figure.legend(handles=_keys(), loc="outside upper left", ncols=5)
        return write_picture(figure, out, rows)


def draw_openings(
    folder: Path, recordings: Mapping[str, Path], out: Path, time: str = "time_s", angle: str = "angle_deg"
) -> list[Path]:
    """Draw the originals over the angle and, below, the recorded angle of some doors over time (Figure 5.3).

    `recordings` are CSV files with a column of seconds and one of degrees, by the door's label.

    Raises:
        DoorDataError: as `draw`; a label that the folder does not have, or a recording that cannot be read.
    """
    from matplotlib.figure import Figure

    profiles = _originals(folder)
    if unknown := [name for name in recordings if name not in profiles]:
        raise DoorDataError(f"--opening {unknown[0]}: {folder} has the doors {some(profiles)}.")
    rows = opening_rows(profiles, {name: _track(path, time, angle) for name, path in recordings.items()})
    colours = {car: COLOURS[number % len(COLOURS)] for number, car in enumerate(profiles)}
    with drawing("openings"):
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        grid = figure.add_gridspec(2, len(recordings), height_ratios=(1.4, 1))
        above, first = figure.add_subplot(grid[0, :]), figure.add_subplot(grid[1, 0])
        others = [figure.add_subplot(grid[1, n], sharex=first, sharey=first) for n in range(1, len(recordings))]
        panels = dict(zip(recordings, (first, *others), strict=True))
        for car, colour in colours.items():
            _line(above, [row for row in rows if row["car"] == car], "profile", colour)
        for car, panel in panels.items():
            _line(panel, [row for row in rows if row["car"] == car], "position", colours[car])
            panel.set(title=car, xlabel="time in s")
        above.axhline(0, color=FAINT, linewidth=0.7, zorder=0)
        above.set(xlim=(0, MAX_ANGLE_DEG), xlabel="angle in degrees", ylabel="force in N")
        first.set_ylabel("angle in degrees")
        first.margins(x=0)
        for panel in others:
            panel.tick_params(labelleft=False)
        figure.legend(handles=above.get_lines()[: len(colours)], loc="outside upper left", ncols=6)
        return write_picture(figure, out, rows)


def _line(panel: Any, rows: Sequence[Row], shows: str, colour: str) -> None:
    x, y = ("angle_deg", "force_N") if shows == "profile" else ("time_s", "angle_deg")
    line = [row for row in rows if row["shows"] == shows]
    panel.plot([row[x] for row in line], [row[y] for row in line], color=colour, linewidth=1.3, label=line[0]["car"])


def feature_rows(profiles: Mapping[str, Array]) -> list[Row]:
    """Return the content of Figure 5.6 for each profile, by the definitions of `palpate.signals.doors.features`.

    `shows` is profile, peak or valley (`value` in N at `angle_deg`), interval (degrees from one peak to the next),
    slope (N per degree from one landmark to the next) or plateau (from `angle_deg` to `to_deg`, `value` its mean in N).
    """
    return [row for car, force_N in profiles.items() for row in _feature_rows(car, force_N)]


def _feature_rows(car: str, force_N: Array) -> Iterator[Row]:
    def row(shows: str, at: int, to: int | None, value: float) -> Row:
        to_deg = None if to is None else grid_angle_deg(to)
        return {"car": car, "shows": shows, "angle_deg": grid_angle_deg(at), "to_deg": to_deg, "value": value}

    marks = landmarks(force_N)
    yield from (row("profile", at, None, float(value)) for at, value in enumerate(force_N))
    yield from (row("peak", at, None, float(force_N[at])) for at in marks.peaks)
    yield from (row("valley", at, None, float(force_N[at])) for at in marks.valleys)
    yield from (row("interval", a, b, grid_angle_deg(b) - grid_angle_deg(a)) for a, b in pairwise(marks.peaks))
    for a, b in pairwise(sorted({0, *marks.peaks, *marks.valleys, marks.end})):
        yield row("slope", a, b, float(force_N[b] - force_N[a]) / (grid_angle_deg(b) - grid_angle_deg(a)))
    if (plateau := plateau_of(force_N, marks)) is not None:
        a, b = plateau
        yield row("plateau", a, b, float(force_N[a : b + 1].mean()))


def opening_rows(profiles: Mapping[str, Array], tracks: Mapping[str, tuple[Array, Array]]) -> list[Row]:
    """Return the content of Figure 5.3: `profile` rows (angle, force), and `position` rows (seconds, angle).

    `tracks` holds seconds and degrees, by the door's label. Seconds count from a track's first row.
    """
    rows: list[Row] = [
        {"shows": "profile", "car": car, "time_s": None, "angle_deg": angle, "force_N": float(force)}
        for car, profile in profiles.items()
        for angle, force in zip(ANGLES, profile, strict=True)
    ]
    for car, (seconds, degrees) in tracks.items():
        rows += [
            {"shows": "position", "car": car, "time_s": float(t - seconds[0]), "angle_deg": float(angle),
             "force_N": None}
            for t, angle in zip(seconds, degrees, strict=True)
        ]  # fmt: skip
    return rows


def _track(path: Path, time: str, angle: str) -> tuple[Array, Array]:
    values = read_columns(path, (time, angle))
    seconds, degrees = np.array(values[time]), np.array(values[angle])
    if len(seconds) < 2 or (np.diff(seconds) <= 0).any():
        raise DoorDataError(f"{path}: two or more rows whose {time} rises are expected.")
    return seconds, degrees


def _table(path: Path) -> list[Mapping[str, str]]:
    table = read_table(path, (), STIMULI)
    rows = [row.cells for row in table.rows()]
    missing = [name for name in NEEDED if not rows or name not in table.header]
    if missing:
        raise DoorDataError(f"{path}: column {', '.join(missing)} missing, or no rows; `palpate doors make` writes it.")
    return rows


def _originals(folder: Path) -> dict[str, Array]:
    """Return the unmodified profile of each door of the folder's table."""
    rows = [row for row in _table(folder / "stimuli.csv") if row["augmentation"] == "original"]
    if not rows:
        raise DoorDataError(f"{folder / 'stimuli.csv'}: no row whose augmentation is 'original'; one a door is drawn.")
    return {row["car"]: np.array(read_profile(folder / row["file"])) for row in rows}


def _features(panel: Any, car: str, rows: Sequence[Row]) -> None:
    def of(shows: str) -> list[Row]:
        return [row for row in rows if row["shows"] == shows]

    end = max((row["to_deg"] for row in of("slope")), default=MAX_ANGLE_DEG)
    heights = {row["angle_deg"]: row["value"] for row in of("profile") if row["angle_deg"] <= end}
    panel.axhline(0, color=FAINT, linewidth=0.7, zorder=0)
    panel.plot(list(heights), list(heights.values()), color=INK, linewidth=1.2, zorder=2)
    for row in of("plateau"):
        panel.axvspan(row["angle_deg"], row["to_deg"], color=COLOURS[4], alpha=0.3, linewidth=0, zorder=0)
    for row in of("slope"):
        angles = (row["angle_deg"], row["to_deg"])
        panel.plot(angles, [heights[at] for at in angles], "--", color=COLOURS[0], linewidth=0.8, zorder=1)
    for row in of("valley"):
        panel.plot(row["angle_deg"], row["value"], "v", color=COLOURS[2], markersize=5, zorder=3)
    for row in of("peak"):
        panel.plot(row["angle_deg"], row["value"], "o", color=COLOURS[1], markersize=5, zorder=3)
        panel.annotate(f"{row['value']:.1f}", (row["angle_deg"], row["value"]), (0, 4), textcoords="offset points",
                       ha="center", fontsize=7.5, color=COLOURS[1])  # fmt: skip
    ends = {"arrowstyle": "|-|,widthA=0.2,widthB=0.2", "color": SOFT, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    for row in of("interval"):
        a, b, high = row["angle_deg"], row["to_deg"], max(heights.values()) * 1.02 + 7
        panel.annotate("", (b, high), (a, high), arrowprops=ends)
        panel.annotate(f"{row['value']:.1f}°", ((a + b) / 2, high), (0, 3), textcoords="offset points", ha="center",
                       fontsize=7.5, color=SOFT)  # fmt: skip
    panel.set_xlim(0, MAX_ANGLE_DEG)
    panel.set_title(car)
    panel.tick_params(labelsize=7.5)


def _keys() -> list[Any]:
    """Return the legend's entries, because not every door has each of the marks."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    return [
        Line2D([], [], color=COLOURS[1], marker="o", markersize=5, linewidth=0, label="peak, N"),
        Line2D([], [], color=COLOURS[2], marker="v", markersize=5, linewidth=0, label="valley"),
        Line2D([], [], color=SOFT, linewidth=0.8, marker="|", markersize=5, label="from peak to peak"),
        Line2D([], [], color=COLOURS[0], linewidth=0.8, linestyle="--", label="slope"),
        Patch(color=COLOURS[4], alpha=0.3, linewidth=0, label="plateau"),
    ]


def _panel(panel: Any, folder: Path, rows: list[Mapping[str, str]], kind: str) -> None:
    panel.axhline(0, color="0.85", linewidth=0.6)
    for row in (row for row in rows if row["augmentation"] == "original"):
        panel.plot(ANGLES, read_profile(folder / row["file"]), color="0.65", linewidth=2.2)
    variants = [row for row in rows if row["augmentation"] == kind and kind != "original"]
    for number, row in enumerate(variants):
        colour = COLOURS[number % ACROSS]
        panel.plot(ANGLES, read_profile(folder / row["file"]), color=colour, linewidth=0.9, label=row["variant"])
    if variants:
        panel.legend(fontsize=6, ncols=3, loc="upper right", handlelength=1, columnspacing=0.8)
    panel.set_xlim(0, MAX_ANGLE_DEG)
    panel.tick_params(labelsize=7)


def _label(panels: Any, rows: list[Mapping[str, str]], cars: list[str], kinds: list[str]) -> None:
    sources = {row["car"]: row["source"] for row in rows}
    bottom, top = panels[0, 0].get_ylim()
    panels[0, 0].set_ylim(bottom, top + 0.12 * (top - bottom))
    for car, line in zip(cars, panels, strict=True):
        line[0].set_ylabel(f"{car} ({sources[car]})\nforce in N", fontsize=7)
    for kind, panel in zip(kinds, panels[0], strict=True):
        panel.set_title(kind, fontsize=8)
    for panel in panels[-1]:
        panel.set_xlabel("angle in degrees", fontsize=7)

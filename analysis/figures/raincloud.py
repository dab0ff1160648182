"""Every participant's mean at each level as a dot, with a box and a half violin above."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.patches import Patch, Rectangle

from palpate.analysis.figures.columns import require_columns
from palpate.analysis.figures.figure_kind import MOST_MARKS, DrawnFigure, FigureData, FigureInput, FigureKind, Marks
from palpate.analysis.figures.lettering import elide, format_number, format_signed, letters_that_fit, widest_pt
from palpate.analysis.figures.level_means import LevelPlaces, LevelSettings, level_name, level_words, with_families
from palpate.analysis.figures.rating_axes import attribute_title, demand_attributes, quarters, scale_note
from palpate.analysis.figures.style import INK, OKABE_ITO, PAPER
from palpate.analysis.ratings.person_cells import person_cells
from palpate.protocols.wording import count, phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from palpate.analysis.plans.answers import Row
    from palpate.analysis.statistics.doubles import Floats

GOLDEN = (math.sqrt(5) - 1) / 2
"""The golden ratio, whose multiples spread any number of dots evenly and deterministically."""
Ends = tuple[float, float]


class RaincloudSettings(LevelSettings):
    """The settings of a raincloud: `whiskers` are the box's, up to the last dot within 1.5 box lengths (Tukey)."""

    figure: Literal["raincloud"]
    whiskers: Literal["none"] = "none"


def data(inputs: FigureInput, settings: RaincloudSettings) -> FigureData:
    """Return a row for each attribute, level and participant: the mean of their ratings."""
    selected = inputs.selected
    demand_attributes(settings.name, selected)
    extra = () if settings.families is None else (settings.families,)
    require_columns(settings, selected.table, (*settings.by, *extra))
    cells = person_cells(selected.table, ("attribute", *settings.by), levels={**selected.levels})
    rows: list[Row] = []
    for j in sorted(range(len(cells.cells)), key=lambda j: selected.outcomes.index(cells.cells[j][0])):
        attribute, *levels = cells.cells[j]
        for i, who in enumerate(cells.participants):
            if not math.isnan(cells.values[i, j]):
                labels = dict(zip(settings.by, levels, strict=True))
                value, ratings = float(cells.values[i, j]), int(cells.counts[i, j])
                rows.append({"attribute": attribute, **labels, "participant": who, "mean": value, "ratings": ratings})
    with_family = with_families(rows, selected.table, settings)
    words = level_words(selected, settings, with_family)
    order = list(dict.fromkeys(str(row["participant"]) for row in rows))
    caption = (
        f"A dot is one participant's mean rating ({count(len(order), 'participant')}), {scale_note(selected)}. Boxes"
        " are quartiles with the median, whiskers reach the last dot within 1.5 box lengths, the diamond is the mean."
        " Curves are Gaussian kernel densities (Silverman's bandwidth), on one scale within a panel."
    )
    title = settings.title or f"Ratings of every participant by {phrase(list(settings.by))}."
    return FigureData(with_family, title, caption, words)


def draw(data: FigureData) -> DrawnFigure:
    """Draw a panel for each attribute, with levels from top to bottom."""
    words, places = data.words, LevelPlaces(data.words)
    attributes = words["attributes"]
    columns = min(len(attributes), 4)
    lines = math.ceil(len(attributes) / columns)
    names = [elide(places.written[key], 26) for key in places.at]
    line_height = 0.46 if len(names) <= 8 else 0.36 if len(names) <= 20 else 0.24
    label_in = widest_pt(names, 8.0) / 72 + 0.2
    panel = {1: 6.4, 2: 4.4, 3: 3.4, 4: 2.8}[columns]
    height = lines * (line_height * (max(places.at.values()) + 1.3) + 0.75)
    figure = Figure(
        figsize=(panel * columns + label_in, height),
        layout=ConstrainedLayoutEngine(h_pad=0.05, w_pad=0.12, hspace=0.03, wspace=0.03),
    )
    axes = figure.subplots(lines, columns, squeeze=False, sharey=True).ravel()
    marks, dots = Marks(), len(data.rows) + len(attributes) * len(names) <= MOST_MARKS
    for place, (panel_axes, attribute) in enumerate(zip(axes, attributes, strict=False)):
        _draw_panel(panel_axes, data, attribute, places, marks, dots, letters_that_fit(panel - 0.25))
        panel_axes.tick_params(axis="y", labelleft=place % columns == 0)
    for empty in axes[len(attributes) :]:
        empty.set_axis_off()
    axes[0].set_yticks([-height for height in places.at.values()], names, fontsize=8.0 if line_height > 0.3 else 6.5)
    axes[0].set_ylim(-max(places.at.values()) - 0.55, 0.75)
    if any(places.members):
        colours = places.colours()
        handles = [Patch(facecolor=colours[name], alpha=0.6) for name in places.members]
        families = [elide(name, 24) for name in places.members]
        columns = min(len(families), 6)
        figure.legend(handles, families, loc="outside lower center", ncols=columns, frameon=False, fontsize=8.5)
    return DrawnFigure(figure, marks.all())


def _draw_panel(
    axes: Axes,
    data: FigureData,
    attribute: Mapping[str, Any],
    places: LevelPlaces,
    marks: Marks,
    dots: bool,
    room: int,
) -> None:
    scale = (data.words["scale"][0], data.words["scale"][1])
    means = [float(row["mean"] or 0.0) for row in data.rows]
    margin = 0.02 * (scale[1] - scale[0])
    axes.set_xlim(min([scale[0], *means]) - margin, max([scale[1], *means]) + margin)
    axes.set_xticks(quarters(scale))
    axes.xaxis.set_major_formatter(lambda value, _: format_signed(value, scale))
    axes.grid(visible=True, axis="x")
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8)
    if attribute["high"]:
        axes.set_title(elide(attribute["low"], room // 2 - 1), loc="left", fontsize=9)
        axes.set_title(elide(attribute["high"], room // 2 - 1), loc="right", fontsize=9)
    else:
        axes.set_title(attribute_title(attribute, room))
    rows_at: dict[tuple[str, ...], list[Row]] = {}
    for row in data.rows:
        if row["attribute"] == attribute["name"]:
            rows_at.setdefault(tuple(str(row[name]) for name in places.by), []).append(row)
    people = {who: i for i, who in enumerate(dict.fromkeys(str(row["participant"]) for row in data.rows))}
    values = {key: np.sort([float(row["mean"] or 0.0) for row in rows]) for key, rows in rows_at.items()}
    clouds = {key: _density(ratings, scale) for key, ratings in values.items()}
    top = max((float(height.max()) for _, height in clouds.values() if len(height)), default=1.0)
    colours = places.colours() if any(places.members) else {"": OKABE_ITO[0]}
    for key, rows in rows_at.items():
        y, colour = -places.at[key], colours[places.family[key]]
        x, height = clouds[key]
        axes.fill_between(x, y + 0.14, y + 0.14 + 0.52 * height / top, color=colour, alpha=0.45, linewidth=0.6)
        _draw_box(axes, values[key], y, colour, marks, (attribute["name"], key, places))
        _draw_dots(axes, rows, y, colour, people, marks if dots else None)


def _density(values: Floats, scale: Ends) -> tuple[Floats, Floats]:
    """Return a Gaussian kernel density cut at the scale; empty without spread.

    The bandwidth is Silverman's (1986, eq. 3.31).
    """
    quarter, three = np.percentile(values, [25, 75])
    sd = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    spread = min(sd, float(three - quarter) / 1.34) or sd
    if spread <= 1e-9 * max(1.0, float(np.abs(values).max())):
        return np.array([]), np.array([])
    width = 0.9 * spread * len(values) ** -0.2
    low, high = float(values[0]) - 3 * width, float(values[-1]) + 3 * width
    x = np.linspace(max(low, min(scale[0], float(values[0]))), min(high, max(scale[1], float(values[-1]))), 120)
    away = (x[:, None] - values[None, :]) / width
    height: Floats = np.exp(-0.5 * away**2).sum(axis=1) / (len(values) * width * math.sqrt(2 * math.pi))
    return x, height


def _draw_box(
    axes: Axes,
    values: Floats,
    y: float,
    colour: str,
    marks: Marks,
    where: tuple[str, tuple[str, ...], LevelPlaces],
) -> None:
    attribute, key, places = where
    quarter, median, three = (float(value) for value in np.percentile(values, [25, 50, 75]))
    inside = values[(values >= quarter - 1.5 * (three - quarter)) & (values <= three + 1.5 * (three - quarter))]
    axes.plot([float(inside[0]), float(inside[-1])], [y, y], color=INK, linewidth=0.8, zorder=2)
    box = Rectangle(
        (quarter, y - 0.085), three - quarter, 0.17, facecolor=PAPER, edgecolor=INK, linewidth=0.8, zorder=3
    )
    axes.add_patch(box)
    axes.plot([median, median], [y - 0.085, y + 0.085], color=INK, linewidth=1.8, solid_capstyle="butt", zorder=4)
    mean = math.fsum(values.tolist()) / len(values)
    axes.plot([mean], [y], marker="D", markersize=3.2, color=colour, markeredgecolor=INK, markeredgewidth=0.6, zorder=5)
    details = [("attribute", attribute), *zip(places.by, key, strict=True), ("mean", format_number(mean))]
    details += [("median", format_number(median)), ("quartiles", f"{format_number(quarter)} to {format_number(three)}")]
    marks.add(box, (*details, ("participants", str(len(values)))), level_name(key))


def _draw_dots(
    axes: Axes, rows: Sequence[Row], y: float, colour: str, people: Mapping[str, int], marks: Marks | None
) -> None:
    """Draw the participants below the box, each at the same height within every level."""
    size = 3.6 if len(rows) <= 60 else 2.6
    style: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markersize": size,
        "color": colour,
        "markeredgecolor": PAPER,
    }
    style |= {"markeredgewidth": 0.3, "zorder": 2, "in_layout": False}
    heights = [y - 0.17 - 0.26 * ((people[str(row["participant"])] * GOLDEN) % 1.0) for row in rows]
    spots = [(float(row["mean"] or 0.0), height) for row, height in zip(rows, heights, strict=True)]
    if marks is None:
        axes.plot(*zip(*spots, strict=True), **style)
        return
    for (x, height), row in zip(spots, rows, strict=True):
        (dot,) = axes.plot([x], [height], **style)
        levels = [(name, str(row[name])) for name in row if name not in ("participant", "mean", "ratings", "family")]
        who = str(row["participant"])
        marks.add(dot, (("participant", who), *levels, ("mean", format_number(x))), who)


RAINCLOUD = FigureKind(RaincloudSettings, data, draw)

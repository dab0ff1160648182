"""Mean ratings as bars, methods side by side for each texture, with marks of significance (thesis Figure 4.9)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from pydantic import Field

from palpate.analysis.figures.columns import answer_of_test, fill_columns, require_columns, to_float
from palpate.analysis.figures.distributions import swarm
from palpate.analysis.figures.figure_kind import DrawnFigure, FigureData, FigureInput, FigureKind, FigureSettings, Marks
from palpate.analysis.figures.lettering import decimals_for, elide, fold, format_number, format_p, shorten, widest_pt
from palpate.analysis.figures.significance import not_drawn_note, pair_rows, stack_brackets, stars_note
from palpate.analysis.figures.style import HATCHES, INK, OKABE_ITO, PAPER, SOFT, quiet_axes, tint
from palpate.analysis.plans.answers import Row, Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import PersonCells, levels_of, person_cells, texts_of
from palpate.analysis.ratings.within_intervals import WITHIN, mean_intervals
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count, phrase

MOST_BRACKETS = 36
WIDE = 0.84
"""The width of all bars of a cluster, in clusters."""
STOREY = 0.075
"""The height of a storey of brackets, as a share of the scale."""


class SimilarityBarsSettings(FigureSettings):
    """The settings of bars: a cluster for each level of `clusters` (None: none), with a bar for each level of `bars`.

    Separate bars over all clusters have the brackets of the one test of `pairs` that `tests` names and `each` does not.
    `each` gives clusters brackets of their own: it maps a level to the name of a test, which `tests` names too.
    `whiskers`: "sd" over participants, or the 95 % (`confidence`) interval "cousineau_morey" or "between". `p` is the
    test's column of p (None: the first of p_adjusted, p_bonferroni, p_holm, p_corr, p that holds a number); `stars` are
    the thresholds of one, two and three stars, those above the plan's alpha left out. `dots` shows each participant.
    """

    figure: Literal["similarity_bars"]
    clusters: str | None = "texture"
    bars: str = "method"
    whiskers: Literal["sd", "cousineau_morey", "between"] = "sd"
    confidence: float = Field(default=0.95, gt=0, lt=1)
    p: str | None = None
    stars: tuple[float, ...] = (0.05, 0.01, 0.001)
    each: Mapping[Text, Text] = {}
    dots: bool = True

    def idle(self) -> Iterator[Idle]:
        """Yield the settings that have no effect in combination with the others."""
        if not self.tests:
            yield from (Idle(name, "without `tests`") for name in ("p", "stars"))
        if self.whiskers == "sd":
            yield Idle("confidence", "with `whiskers: sd`")


def data(inputs: FigureInput, settings: SimilarityBarsSettings) -> FigureData:
    """Return rows of three kinds (`shows`): each bar's "mean", each participant's "value" in it, each "pair".

    `cluster` is None for the bars over all clusters: the mean of each participant's cluster means, for participants
    with a value in every cell. Raises DataRefused where a column or a test is missing, or ratings of several attributes
    would be mixed; a StatisticsError where a value is no number.
    """
    selected = inputs.selected
    if "attribute" in selected.table.columns and selected.table["attribute"].nunique() > 1:
        names = ", ".join(map(str, selected.table["attribute"].unique()))
        raise DataRefused(f"figure {settings.name!r}: ratings of {names}; name the one to show in `outcomes`")
    by = [name for name in (settings.clusters, settings.bars) if name is not None]
    require_columns(settings, selected.table, ["participant", "value", *by])
    cells = person_cells(selected.table, by, levels=selected.levels)
    occurring = list(dict.fromkeys(cells.level(settings.bars)))
    known = [level for level in selected.levels.get(settings.bars, ()) if level in occurring]
    bars = [*known, *(level for level in occurring if level not in known)]
    clusters = list(dict.fromkeys(cells.level(settings.clusters))) if settings.clusters else []
    rows = _bar_rows(settings, selected, selected.table, by) if clusters else []
    overall = selected.table
    if clusters:
        # Each complete participant's mean over the clusters, for each bar; no row where nobody is complete.
        complete: Any = ~np.isnan(cells.values).any(axis=1)
        of_bar = np.array(cells.level(settings.bars))
        full = len(cells.cells) == len(clusters) * len(occurring)
        means = [
            {"participant": person, settings.bars: level, "value": float(np.mean(cells.values[i, of_bar == level]))}
            for i, person in enumerate(cells.participants)
            if complete[i] and full
            for level in occurring
        ]
        overall = pd.DataFrame(means, columns=["participant", settings.bars, "value"])
    rows += [] if overall.empty else _bar_rows(settings, selected, overall, [settings.bars])
    rows += _pairs(inputs, settings, selected, bars, clusters)
    words: dict[str, Any] = {"clusters": clusters, "bars": bars, "scale": selected.scale, "dots": settings.dots}
    words["cluster_factor"] = settings.clusters or ""
    outcome = selected.outcomes[0] if len(selected.outcomes) == 1 else ""
    high = selected.antonyms.get(outcome, "")
    words["what"] = f"Mean rating (high: {high})" if high else f"Mean {outcome or 'rating'}"
    methods = dict.fromkeys(answer_of_test(settings, inputs, name).method for name in settings.tests)
    tested = "".join(f" {method.rstrip('.')}." for method in methods if method)
    title = settings.title or f"{words['what']} by {settings.bars}"
    return FigureData(fill_columns(rows), title, _caption(settings, selected, cells, rows) + tested, words)


def _bar_rows(
    settings: SimilarityBarsSettings, selected: Selected, table: pd.DataFrame, by: list[str]
) -> list[dict[str, Any]]:
    """Return the mean of every bar, then every participant's value in it; overall bars without clusters in `by`."""
    clustered, method = len(by) == 2, "none" if settings.whiskers == "sd" else settings.whiskers
    stimuli: dict[tuple[str, str], set[str]] = {}
    if clustered and "stimulus" in table.columns:
        for cluster, bar, stimulus in zip(*(texts_of(table, name) for name in (*by, "stimulus")), strict=True):
            stimuli.setdefault((cluster, bar), set()).add(stimulus)
    means = mean_intervals(
        table,
        by=by,
        method=method,
        confidence=settings.confidence,
        missing="listwise" if method in WITHIN else "raise",
        levels=levels_of(selected.levels, by),
    )
    rows: list[dict[str, Any]] = []
    for mean in means.to_dict("records"):
        place = {"cluster": mean[by[0]] if clustered else None, "bar": mean[by[-1]]}
        if clustered:  # the stimulus of a cell, where it is only one
            names = stimuli.get((mean[by[0]], mean[by[1]]), set())
            place["stimulus"] = next(iter(names)) if len(names) == 1 else None
        low, high = (
            (mean["ci_low"], mean["ci_high"])
            if settings.whiskers != "sd"
            else (mean["mean"] - mean["sd"], mean["mean"] + mean["sd"])
        )
        numbers = {"mean": mean["mean"], "sd": mean["sd"], "low": low, "high": high}
        known = {name: nan_to_none(float(value)) for name, value in numbers.items()}
        rows.append({"shows": "mean", **place, "n": int(mean["n"]), **known, "note": mean["note"]})
    cells = person_cells(table, by, levels=selected.levels)
    for j, cell in enumerate(cells.cells):
        place = {"cluster": cell[0] if clustered else None, "bar": cell[-1]}
        for i, person in enumerate(cells.participants):
            if not np.isnan(cells.values[i, j]):
                rows.append({"shows": "value", **place, "participant": person, "value": float(cells.values[i, j])})
    return rows


def _pairs(
    inputs: FigureInput, settings: SimilarityBarsSettings, selected: Selected, bars: list[str], clusters: list[str]
) -> list[dict[str, Any]]:
    """Return the pairs of the overall test, then of each cluster's own.

    Raises DataRefused where `each` and `tests` contradict each other.
    """
    where = f"figure {settings.name!r}"
    for level, test in settings.each.items():
        if level not in clusters:
            raise DataRefused(f"{where}: `each` names the cluster {level!r}; {nearest(level, clusters)}")
        if test not in settings.tests:
            raise DataRefused(
                f"{where}: `each` names the test {test!r}, `tests` does not; {nearest(test, settings.tests)}"
            )
    over = [name for name in settings.tests if name not in settings.each.values()]
    if len(over) > 1:
        raise DataRefused(
            f"{where}: {phrase(over)} cannot both stand over all clusters; name a cluster's own in `each`"
        )
    thresholds = [t for t in sorted(settings.stars, reverse=True) if t <= selected.alpha]
    places: list[tuple[str | None, str]] = [*((None, name) for name in over), *settings.each.items()]
    return [
        {"shows": "pair", "cluster": cluster, **row}
        for cluster, name in places
        for row in pair_rows(settings, answer_of_test(settings, inputs, name), settings.p, bars, thresholds)
    ]


def _caption(
    settings: SimilarityBarsSettings, selected: Selected, cells: PersonCells, rows: list[dict[str, Any]]
) -> str:
    complete = int((~np.isnan(cells.values).any(axis=1)).sum())
    level = f"{100 * settings.confidence:g} %"
    whiskers = {
        "sd": "± 1 SD over participants",
        "cousineau_morey": f"the {level} within-participant interval of Cousineau and Morey",
        "between": f"the {level} interval between participants",
    }[settings.whiskers]
    parts = [f"Bars: means over {count(len(cells.participants), 'participant')}."]
    known = any(row.get("low") is not None for row in rows)
    parts.append(f"Whiskers: {whiskers}." if known else "No whiskers: one participant has no spread.")
    if settings.dots:
        parts.append("Dots: participants.")
    if complete < len(cells.participants):
        within = "" if settings.whiskers in ("sd", "between") else " and in the intervals"
        parts.append(f"With a value in every cell: {complete}; only they count where all is averaged{within}.")
    pairs = [row for row in rows if row["shows"] == "pair"]
    if pairs:
        thresholds = [t for t in sorted(settings.stars, reverse=True) if t <= selected.alpha]
        different = [row for row in pairs if row["stars"]]
        note = f"Brackets: pairs that differ ({stars_note(thresholds)})."
        if not different:
            note = "No pair differs significantly."
        elif len(different) > MOST_BRACKETS:
            note = f"{len(different)} of {len(pairs)} pairs differ, too many for brackets; their p stand in the table."
        parts.append(note + not_drawn_note(pairs))
    return " ".join(parts)


@dataclass(frozen=True)
class _Bars:
    """The common inputs of drawing bars."""

    data: FigureData
    marks: Marks
    base: float
    span: float
    digits: int

    def look(self, bar: str) -> dict[str, Any]:
        """Return the colour and hatch of a method."""
        place = self.data.words["bars"].index(bar)
        colour = OKABE_ITO[place % len(OKABE_ITO)]
        return {
            "facecolor": tint(colour),
            "edgecolor": colour,
            "linewidth": 0.9,
            "hatch": HATCHES[place % len(HATCHES)],
        }


def draw(data: FigureData) -> DrawnFigure:
    """Draw the clusters on the left, the overall bars with their brackets on the right, on one axis."""
    clusters, bars = data.words["clusters"], data.words["bars"]
    overall = any(row["shows"] == "mean" and row["cluster"] is None for row in data.rows)
    panels: list[list[str | None]] = ([list(clusters)] if clusters else []) + ([[None]] if overall else [])
    spans = [_spans(data, _brackets(data, cluster)) for panel in panels for cluster in panel]
    storeys = max((max(stack_brackets(places), default=-1) + 1 for places in spans), default=0)
    # How wide a panel is, in inches: very many clusters are pressed together, the bars over all never.
    wide = []
    for panel in panels:
        if list(panel) == [None]:
            names_in = widest_pt([fold(bar, 10) for bar in bars], 8) / 72 + 0.08
            wide.append(max(1.0, 0.3 + min(max(0.42, names_in), 1.0) * len(bars)))
        else:
            wide.append(min(max(1.0, len(panel) * (0.3 + 0.24 * len(bars))), 14.0))
    names = [shorten(str(cluster), 26) for cluster in clusters]
    upright = bool(names) and _letters(wide[0] / len(names), len(names))[1]
    size = (max(4.6, sum(wide) + 1.0), 3.3 + 0.17 * storeys + (widest_pt(names, 6) / 72 if upright else 0.0))
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(1, len(panels), squeeze=False, sharey=True, width_ratios=wide)[0]
    columns = ("mean", "value", "low", "high")
    values = [to_float(row[name]) for row in data.rows for name in columns if row.get(name) is not None]
    scale = data.words["scale"]
    low, high = scale or (min(0.0, *values), max(0.0, *values))
    # Bars start at zero where the scale has it, else at its nearest end.
    tools = _Bars(data, Marks(), min(max(0.0, low), high), (high - low) or 1.0, decimals_for(values))
    for axes, panel in zip(grid, panels, strict=True):
        _draw_panel(axes, tools, panel, wide[0] / len(panel))
    # Ticks stand on the study's scale only; above it there is room for brackets.
    tops = max(_top(tools, cluster) for cluster in (None, *clusters))
    low = min([scale[0] if scale else tools.base, *values])
    high = max([scale[1] if scale else tops, tops + (storeys + 0.8) * STOREY * tools.span if storeys else tops])
    grid[0].set_ylim(low - 0.01 * tools.span * (low < tools.base), high + 0.01 * tools.span)
    if scale:
        grid[0].set_yticks([scale[0] + i * (scale[1] - scale[0]) / 4 for i in range(5)])
    letters = int(14 * (size[1] - 0.7))
    grid[0].set_ylabel(fold(elide(str(data.words["what"]), 2 * letters - 12), letters))
    if clusters:
        handles = [Patch(**tools.look(bar)) for bar in bars]
        bar_names = [fold(bar, 24) for bar in bars]
        abreast = max(1, min(len(bars), int(figure.get_figwidth() / (0.55 + 0.075 * max(map(len, bar_names))))))
        figure.legend(
            handles, bar_names, loc="outside upper left", ncols=abreast, frameon=False, fontsize=8.5,
            labelcolor=SOFT, handlelength=1.6, handleheight=1.1, columnspacing=1.3,
        )  # fmt: skip
    return DrawnFigure(figure, tools.marks.all())


def _letters(cluster_in: float, clusters: int) -> tuple[int, bool]:
    """Return how many letters fit below a cluster, and whether names must be upright because these are too few."""
    letters = max(5, int(cluster_in / 0.075))
    return letters, letters < 8 and clusters > 12


def _rows_of(data: FigureData, shows: str, cluster: str | None) -> list[Row]:
    return [row for row in data.rows if row["shows"] == shows and row["cluster"] == cluster]


def _brackets(data: FigureData, cluster: str | None) -> list[Row]:
    pairs = [row for row in _rows_of(data, "pair", cluster) if row["stars"]]
    return pairs if len(pairs) <= MOST_BRACKETS else []


def _spans(data: FigureData, rows: Sequence[Row]) -> list[tuple[int, int]]:
    bars = data.words["bars"]
    return [(bars.index(row["a"]), bars.index(row["b"])) for row in rows]


def _draw_panel(axes: Axes, tools: _Bars, panel: Sequence[str | None], cluster_in: float) -> None:
    """Draw each cluster's bars around its place."""
    bars = tools.data.words["bars"]
    bars_at: list[tuple[float, Row]] = []
    for place, cluster in enumerate(panel):
        at = {bar: place + WIDE * ((i + 0.5) / len(bars) - 0.5) for i, bar in enumerate(bars)}
        cluster_bars = [(at[str(row["bar"])], row) for row in _rows_of(tools.data, "mean", cluster)]
        for x, row in cluster_bars:
            _draw_bar(axes, tools, row, x, WIDE / len(bars))
        bars_at += cluster_bars
        _draw_brackets(axes, tools, cluster, at)
    # All whiskers at once, on a thin halo that keeps them apart from dots and hatches.
    known = [(x, row) for x, row in bars_at if row["low"] is not None and row["high"] is not None]
    if known:
        mean, low, high = ([to_float(row[name]) for _, row in known] for name in ("mean", "low", "high"))
        reach = [[m - e for m, e in zip(mean, low, strict=True)], [e - m for m, e in zip(mean, high, strict=True)]]
        places = [x for x, _ in known]
        axes.errorbar(places, mean, reach, fmt="none", ecolor=PAPER, elinewidth=1.9, alpha=0.7, zorder=3.4)
        axes.errorbar(places, mean, reach, fmt="none", ecolor=INK, elinewidth=1.1, capsize=2.4, zorder=3.5)
    axes.set_xlim(-0.5, len(panel) - 0.5)
    quiet_axes(axes)
    if list(panel) == [None]:
        names = [fold(bar, 10) for bar in bars]
        axes.set_xticks([WIDE * ((i + 0.5) / len(bars) - 0.5) for i in range(len(bars))], names, fontsize=8)
        axes.tick_params(axis="x", rotation=90 if sum(map(len, names)) > 12 * len(bars) and len(bars) > 6 else 0)
        if tools.data.words["clusters"]:
            axes.set_xlabel("all together", fontsize=8.5, color=SOFT)
        return
    letters, upright = _letters(cluster_in, len(panel))
    names = [shorten(str(c), 26) if upright else fold(str(c).replace("_", " "), letters) for c in panel]
    axes.set_xticks(range(len(panel)), names, fontsize=8 if len(panel) <= 24 else 6)
    axes.tick_params(axis="x", rotation=90 if upright else 0)
    axes.set_xlabel(str(tools.data.words["cluster_factor"]), fontsize=8.5, color=SOFT)


def _draw_bar(axes: Axes, tools: _Bars, row: Row, at: float, wide: float) -> None:
    mean, look = to_float(row["mean"]), tools.look(str(row["bar"]))
    with_hatch = {**look, "hatch": look["hatch"] if wide > 0.05 else ""}
    bar = axes.bar([at], [mean - tools.base], 0.9 * wide, bottom=tools.base, zorder=2, **with_hatch)[0]
    place = "all together" if row["cluster"] is None else str(row["cluster"])
    numbers = [
        (name, format_number(to_float(row[name]), tools.digits)) for name in ("mean", "sd") if row[name] is not None
    ]
    ends = []
    if row["low"] is not None:
        low, high = (format_number(to_float(row[end]), tools.digits) for end in ("low", "high"))
        ends = [("whisker", f"{low} to {high}")]
    details = (("bar", f"{row['bar']}, {place}"), *numbers, *ends, ("n", str(row["n"])))
    tools.marks.add(bar, details, str(row.get("stimulus") or row["bar"]))
    if tools.data.words["dots"]:
        cluster = None if row["cluster"] is None else str(row["cluster"])
        values = [to_float(r["value"]) for r in _rows_of(tools.data, "value", cluster) if r["bar"] == row["bar"]]
        size = 0.022 * tools.span
        aside = swarm(values, size, size * 4)
        places = [at + a / size / 4 * 0.36 * wide for a in aside]
        dot: dict[str, Any] = {"marker": "o", "markersize": 2.2, "markeredgewidth": 0.3, "markeredgecolor": PAPER}
        axes.plot(places, values, linestyle="", color=INK, alpha=0.7, zorder=3, **dot)


def _top(tools: _Bars, cluster: str | None) -> float:
    """Return the greatest height that is drawn in a cluster."""
    rows = [
        *_rows_of(tools.data, "mean", cluster),
        *(_rows_of(tools.data, "value", cluster) if tools.data.words["dots"] else []),
    ]
    known = [to_float(row[name]) for row in rows for name in ("mean", "high", "value") if row.get(name) is not None]
    top: float = max([tools.base, *known])
    return top


def _draw_brackets(axes: Axes, tools: _Bars, cluster: str | None, at: dict[str, float]) -> None:
    rows = _brackets(tools.data, cluster)
    floor = _top(tools, cluster) + 0.6 * STOREY * tools.span
    inset = 0.12 * WIDE / len(at)
    for row, storey in zip(rows, stack_brackets(_spans(tools.data, rows)), strict=True):
        height, foot = floor + storey * STOREY * tools.span, 0.018 * tools.span
        left, right = at[str(row["a"])] + inset, at[str(row["b"])] - inset
        axes.plot([left, left, right, right], [height - foot, height, height, height - foot], color=INK, linewidth=0.9)
        text = axes.annotate(
            str(row["stars"]),
            ((left + right) / 2, height),
            (0, 0.3),
            textcoords="offset points",
            ha="center",
            fontsize=9,
        )
        details = (
            ("pair", f"{row['a']} and {row['b']}"),
            ("p", format_p(to_float(row["p"])).removeprefix("p = ").removeprefix("p ")),
        )
        tools.marks.add(text, details)


SIMILARITY_BARS = FigureKind(SimilarityBarsSettings, data, draw)

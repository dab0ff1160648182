"""Mean ratings as bars, methods side by side for each texture, with marks of significance (thesis Figure 4.9)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field

from palpate.analysis.figures.drawn import AskedFigure, FigureData, FigureKind, Shown
from palpate.analysis.figures.shown_columns import answer_of, require, uniform
from palpate.analysis.figures.significance import not_drawn_said, pair_rows, stars_said
from palpate.analysis.figures.similarity_bars_drawing import MOST_BRACKETS, draw
from palpate.analysis.plans.answers import Selected
from palpate.analysis.plans.idle import Idle
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.person_cells import PersonCells, levels_of, person_cells, texts_of
from palpate.analysis.ratings.within_intervals import WITHIN, mean_intervals
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.study import Text
from palpate.protocols.undefined import nan_to_none
from palpate.protocols.wording import count, phrase

__all__ = ["SIMILARITY_BARS", "SimilarityBarsSettings", "data", "draw"]


class SimilarityBarsSettings(AskedFigure):
    """A cluster for each level of `clusters` (None: none), in it a bar for each level of `bars`.

    Apart stand the bars over all clusters, with the brackets of the one test of `pairs` that `tests` names and `each`
    does not. `each` gives a cluster brackets of its own: its level to the name of a test, which `tests` names too.
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
        """Yield the settings that change nothing beside the others."""
        if not self.tests:
            yield from (Idle(name, "without `tests`") for name in ("p", "stars"))
        if self.whiskers == "sd":
            yield Idle("confidence", "with `whiskers: sd`")


def data(shown: Shown, settings: SimilarityBarsSettings) -> FigureData:
    """Rows of three sorts (`shows`): each bar's "mean", each participant's "value" in it, and the "pair"s compared.

    `cluster` is None for the bars over all clusters: the mean of each participant's cluster means, for participants
    with a value in every cell. Raises DataRefused where a column or a test is missing, or ratings of several
    attributes would be mixed; a StatisticsError where a value is no number.
    """
    selected = _one_attribute(settings, shown.selected)
    by = [name for name in (settings.clusters, settings.bars) if name is not None]
    require(settings, selected.table, ["participant", "value", *by])
    cells = person_cells(selected.table, by, levels=selected.levels)
    bars = list(dict.fromkeys(_ordered(selected, settings.bars, cells.level(settings.bars))))
    clusters = list(dict.fromkeys(cells.level(settings.clusters))) if settings.clusters else []
    rows = _bar_rows(settings, selected, cells) if clusters else []
    overall = _over_clusters(cells, settings.bars) if clusters else selected.table
    rows += _overall_rows(settings, selected, overall)
    rows += _pairs(shown, settings, selected, bars, clusters)
    words: dict[str, Any] = {"clusters": clusters, "bars": bars, "scale": selected.scale, "dots": settings.dots}
    words["cluster_factor"] = settings.clusters or ""
    words["what"] = _axis(selected)
    title = settings.title or f"{words['what']} by {settings.bars}"
    return FigureData(
        uniform(rows), title, f"{_caption(settings, selected, cells, rows)}{_methods(shown, settings)}", words
    )


def _one_attribute(settings: SimilarityBarsSettings, selected: Selected) -> Selected:
    if "attribute" in selected.table.columns and selected.table["attribute"].nunique() > 1:
        found = ", ".join(map(str, selected.table["attribute"].unique()))
        raise DataRefused(f"figure {settings.name!r}: ratings of {found}; name the one to show in `outcomes`")
    return selected


def _axis(selected: Selected) -> str:
    """The high end of the scale names what a higher bar is."""
    name = selected.outcomes[0] if len(selected.outcomes) == 1 else ""
    high = selected.antonyms.get(name, "")
    return f"Mean rating (high: {high})" if high else f"Mean {name or 'rating'}"


def _ordered(selected: Selected, name: str, levels: list[str]) -> list[str]:
    known = [level for level in selected.levels.get(name, ()) if level in levels]
    return [*known, *(level for level in levels if level not in known)]


def _bar_rows(settings: SimilarityBarsSettings, selected: Selected, cells: PersonCells) -> list[dict[str, Any]]:
    """The mean and the values of every cell."""
    clusters, bars = cells.level(cells.by[0]), cells.level(cells.by[1])
    stimuli = _stimuli(settings, selected)
    told = _intervals(settings, selected, selected.table, list(cells.by))
    rows = [
        {
            "shows": "mean",
            "cluster": row[cells.by[0]],
            "bar": row[cells.by[1]],
            "stimulus": stimuli.get((row[cells.by[0]], row[cells.by[1]])),
            **_shown(settings, row),
        }
        for row in told
    ]
    return rows + [
        {
            "shows": "value",
            "cluster": clusters[j],
            "bar": bars[j],
            "participant": person,
            "value": float(cells.values[i, j]),
        }
        for j in range(len(cells.cells))
        for i, person in enumerate(cells.participants)
        if not np.isnan(cells.values[i, j])
    ]


def _stimuli(settings: SimilarityBarsSettings, selected: Selected) -> dict[tuple[str, str], str]:
    """The stimulus of a cell, where it is only one."""
    if "stimulus" not in selected.table.columns:
        return {}
    columns = [texts_of(selected.table, name) for name in (str(settings.clusters), settings.bars, "stimulus")]
    found: dict[tuple[str, str], set[str]] = {}
    for cluster, bar, stimulus in zip(*columns, strict=True):
        found.setdefault((cluster, bar), set()).add(stimulus)
    return {place: names.pop() for place, names in found.items() if len(names) == 1}


def _over_clusters(cells: PersonCells, bars: str) -> pd.DataFrame:
    """Each complete participant's mean over the clusters, for each bar; no row where nobody is complete."""
    complete: Any = ~np.isnan(cells.values).any(axis=1)
    levels = np.array(cells.level(bars))
    full = len(cells.cells) == len(set(cells.level(cells.by[0]))) * len(set(cells.level(bars)))
    rows = [
        {"participant": person, bars: level, "value": float(np.mean(cells.values[i, levels == level]))}
        for i, person in enumerate(cells.participants)
        if complete[i] and full
        for level in dict.fromkeys(cells.level(bars))
    ]
    return pd.DataFrame(rows, columns=["participant", bars, "value"])


def _overall_rows(settings: SimilarityBarsSettings, selected: Selected, table: pd.DataFrame) -> list[dict[str, Any]]:
    if table.empty:
        return []
    means = _intervals(settings, selected, table, [settings.bars])
    rows = [{"shows": "mean", "cluster": None, "bar": row[settings.bars], **_shown(settings, row)} for row in means]
    cells = person_cells(table, [settings.bars], levels=selected.levels)
    return rows + [
        {"shows": "value", "cluster": None, "bar": cell[0], "participant": person, "value": float(cells.values[i, j])}
        for j, cell in enumerate(cells.cells)
        for i, person in enumerate(cells.participants)
        if not np.isnan(cells.values[i, j])
    ]


def _intervals(
    settings: SimilarityBarsSettings, selected: Selected, table: pd.DataFrame, by: list[str]
) -> list[dict[str, Any]]:
    method = "none" if settings.whiskers == "sd" else settings.whiskers
    found = mean_intervals(
        table,
        by=by,
        method=method,
        confidence=settings.confidence,
        missing="listwise" if method in WITHIN else "raise",
        levels=levels_of(selected.levels, by),
    )
    return [{str(name): value for name, value in row.items()} for row in found.to_dict("records")]


def _shown(settings: SimilarityBarsSettings, row: Mapping[str, Any]) -> dict[str, Any]:
    low, high = (
        (row["ci_low"], row["ci_high"])
        if settings.whiskers != "sd"
        else (row["mean"] - row["sd"], row["mean"] + row["sd"])
    )
    numbers = {"mean": row["mean"], "sd": row["sd"], "low": low, "high": high}
    return {
        "n": int(row["n"]),
        **{name: nan_to_none(float(value)) for name, value in numbers.items()},
        "note": row["note"],
    }


def _pairs(
    shown: Shown, settings: SimilarityBarsSettings, selected: Selected, bars: list[str], clusters: list[str]
) -> list[dict[str, Any]]:
    """The pairs of the overall test, then of each cluster's own."""
    over = _overall_test(settings, clusters)
    thresholds = [t for t in sorted(settings.stars, reverse=True) if t <= selected.alpha]
    places: list[tuple[str | None, str]] = [*((None, name) for name in over), *settings.each.items()]
    return [
        {"shows": "pair", "cluster": cluster, **row}
        for cluster, name in places
        for row in pair_rows(settings, answer_of(settings, shown, name), settings.p, bars, thresholds)
    ]


def _overall_test(settings: SimilarityBarsSettings, clusters: list[str]) -> list[str]:
    """The test over all clusters, if there is one; `each` and `tests` must fit one another."""
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
    return over


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
        parts.append(_marks_said(settings, selected, pairs))
    return " ".join(parts)


def _methods(shown: Shown, settings: SimilarityBarsSettings) -> str:
    """What was tested, in the tests' own words."""
    methods = dict.fromkeys(answer_of(settings, shown, name).method for name in settings.tests)
    return "".join(f" {method.rstrip('.')}." for method in methods if method)


def _marks_said(settings: SimilarityBarsSettings, selected: Selected, pairs: list[dict[str, Any]]) -> str:
    thresholds = [t for t in sorted(settings.stars, reverse=True) if t <= selected.alpha]
    found = [row for row in pairs if row["stars"]]
    drawn = f"Brackets: pairs that differ ({stars_said(thresholds)})." if found else "No pair differs significantly."
    if len(found) > MOST_BRACKETS:
        drawn = f"{len(found)} of {len(pairs)} pairs differ, too many for brackets; their p stand in the table."
    return drawn + not_drawn_said(pairs)


SIMILARITY_BARS = FigureKind(SimilarityBarsSettings, data, draw)

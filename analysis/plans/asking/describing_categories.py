"""The answer about physical against emotional attributes: how they are rated, and how far people differ on them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from palpate.analysis.plans.asking.describing_rows import (
    answer_of,
    complete_rows,
    plain_row,
    plain_rows,
    require_columns,
    share,
    turned_note,
)
from palpate.analysis.ratings.categories import category_cells, category_differences, overall, turned, two_categories
from palpate.analysis.ratings.disagreement import Disagreement, attribute_spreads, disagreement
from palpate.analysis.ratings.one_sample import OneSample, columns_of
from palpate.analysis.ratings.person_cells import PersonCells
from palpate.analysis.ratings.trends import CORRECTIONS
from palpate.analysis.statistics.apa import apa_p, number
from palpate.analysis.statistics.pvalues import adjusted
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.analysis.statistics.within import rm_anova

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.asking.describing import Categories

Pair = tuple[str, str]


def categories(selected: Selected, asked: Categories) -> Answer:
    """Mean ratings and SDs between participants of two categories; level by level and attribute by attribute beside."""
    require_columns(selected.table, (*asked.by, *asked.over))
    pair = two_categories(selected.categories, selected.outcomes)
    table, notes = complete_rows(selected, asked)
    table = turned(table, asked.reversed, selected.scale)
    cells = category_cells(table, selected.categories, asked.by, levels=selected.levels)
    spread = disagreement(table, selected.categories, pair, over=asked.over, confidence=asked.confidence)
    if spread.left_out:
        notes.append(f"{spread.left_out} cells with fewer than three participants take no part in the SDs.")
    within = " x ".join(asked.over)
    method = (
        f"Mean over each category's attributes, each counting equally: {pair[1]} minus {pair[0]}, paired t over"
        f" participants. SD between participants: root of the mean variance within attribute x {within}; its ratio by"
        " the jackknife over participants of its logarithm (Miller 1968)"
    )
    spreads = attribute_spreads(table, asked.over)
    more = {
        "levels": tuple(_level_rows(cells, pair, asked)),
        "category_x_level": tuple(_interaction(cells)),
        "attributes": tuple(
            plain_row({"attribute": name, "category": selected.categories[name], "sd": spreads[name]})
            for name in selected.outcomes
        ),
    }
    return answer_of(
        selected,
        _rows(cells, spread, pair, asked),
        method,
        _kinds(pair, within, asked.confidence),
        table=table,
        headline=_headline(spread, pair, asked.confidence),
        notes=[*notes, *turned_note(asked.reversed, selected)],
        more=more,
    )


def _rows(cells: PersonCells, spread: Disagreement, pair: Pair, asked: Categories) -> list[Row]:
    whole = overall(cells)
    ((_, mean),) = category_differences(whole, pair, asked.confidence)
    sides = {name: float(np.nanmean(whole.values[:, whole.level("category").index(name)])) for name in pair}
    of_mean = {name: value for name, value in columns_of(mean).items() if name not in ("mean", "sd", "dz")}
    return [
        plain_row(
            {"measure": "mean rating", **sides, "difference": mean.mean, "ratio": None, **of_mean, "note": mean.note}
        ),
        plain_row(
            {
                "measure": "SD between participants",
                pair[0]: spread.first,
                pair[1]: spread.second,
                "difference": None,
                "ratio": spread.ratio,
                "n": spread.n,
                "ci_low": spread.low,
                "ci_high": spread.high,
                "t": spread.t,
                "df": spread.df,
                "p": spread.p,
                "note": spread.note,
            }
        ),
    ]


def _kinds(pair: Pair, within: str, confidence: float) -> dict[str, str]:
    side = f"mean over participants; SD between participants within attribute x {within}"
    interval = share(confidence, "interval of the difference (Student's t) or of the ratio (jackknife)")
    return {
        pair[0]: side,
        pair[1]: side,
        "difference": f"{pair[1]} minus {pair[0]}",
        "ratio": f"{pair[1]} over {pair[0]}",
        "n": "participants",
        "ci_low": interval,
        "ci_high": interval,
        "t": "paired t; t of the jackknifed log ratio",
        "df": "degrees of freedom",
        "p": "two-sided p, not adjusted",
        "sd": "SD between participants",
    }


def _level_rows(cells: PersonCells, pair: Pair, asked: Categories) -> list[Row]:
    """Both categories' means at each level, and their difference with its p corrected over the levels."""
    found = category_differences(cells, pair, asked.confidence)
    corrected = adjusted([each.p for _, each in found], CORRECTIONS[asked.correction])
    rows = []
    for (label, each), p in zip(found, corrected, strict=True):
        sides = {name: float(np.nanmean(cells.values[:, cells.cells.index((name, *label))])) for name in pair}
        rows.append(plain_row({**dict(zip(asked.by, label, strict=True)), **sides, **_difference(each, p, len(found))}))
    return rows


def _difference(each: OneSample, corrected: float, size: int) -> dict[str, object]:
    numbers: dict[str, object] = dict(columns_of(each))
    numbers["difference"] = numbers.pop("mean")
    return {**numbers, "p_corrected": corrected, "family_size": size, "note": each.note}


def _interaction(cells: PersonCells) -> list[Row]:
    """The analysis of variance of category x levels, or why there is none."""
    people, where = np.meshgrid(np.arange(len(cells.participants)), np.arange(len(cells.cells)), indexing="ij")
    data = pd.DataFrame([cells.cells[j] for j in where.ravel()], columns=list(cells.by))
    data["participant"] = [cells.participants[i] for i in people.ravel()]
    data["value"] = cells.values.ravel()
    try:
        table = rm_anova(data, dv="value", within=list(cells.by), subject="participant")
    except StatisticsError as refusal:
        return [{"Source": ":".join(cells.by), "note": f"no analysis of variance: {refusal}"}]
    return [row for row in plain_rows(table) if "category" in str(row["Source"]).split(":")]


def _headline(spread: Disagreement, pair: Pair, confidence: float) -> str:
    if spread.note and not spread.p > 0:
        return ""
    which = f"differ more on {pair[1] if spread.ratio > 1 else pair[0]} attributes"
    if spread.low <= 1 <= spread.high:
        which = "were not found to differ more on one category"
    return (
        f"Participants {which}: SD {number(spread.second)} ({pair[1]}) against"
        f" {number(spread.first)} ({pair[0]}), ratio {number(spread.ratio)}, {share(confidence, 'CI')}"
        f" [{number(spread.low)}, {number(spread.high)}], {apa_p(spread.p)}."
    )

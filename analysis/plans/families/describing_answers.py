"""The answers about means, trends and target errors from the selected rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import (
    Answer,
    Row,
    Selected,
    answer_of,
    averaged_note,
    plain_row,
    plain_rows,
    require_columns,
    sample_kinds,
    share,
    turned_note,
)
from palpate.analysis.plans.families.rows import complete_rows, refuse_averaging
from palpate.analysis.ratings.categories import category_cells, category_differences, overall, turned, two_categories
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.disagreement import Disagreement, attribute_spreads, disagreement
from palpate.analysis.ratings.one_sample import columns_of
from palpate.analysis.ratings.person_cells import PersonCells, constant_columns, levels_of, person_cells
from palpate.analysis.ratings.target_errors import ALL, CATEGORY, TargetError, target_errors
from palpate.analysis.ratings.trends import CORRECTIONS, cell_trends, families_of, steps_of
from palpate.analysis.ratings.within_intervals import mean_intervals
from palpate.analysis.statistics.anova import rm_anova
from palpate.analysis.statistics.apa import apa_p, number
from palpate.analysis.statistics.f_and_t import adjusted
from palpate.analysis.statistics.refusals import StatisticsError
from palpate.protocols.wording import some

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.families.describing import Categories, Means, TargetErrors, Trends


INTERVALS = {
    "cousineau_morey": "within-participant interval (Cousineau 2005, corrected by Morey 2008)",
    "loftus_masson": "pooled within-participant interval (Loftus & Masson 1994)",
    "between": "Student's interval of each mean over participants",
    "none": "no interval",
}


def means(selected: Selected, settings: Means) -> Answer:
    """Return one row per cell: mean and SD over participants, and the requested interval."""
    require_columns(selected.table, settings.by)
    groups = constant_columns(selected.table, settings.by)
    intervals = mean_intervals(
        selected.table,
        by=settings.by,
        between=groups,
        method=settings.interval,
        confidence=settings.confidence,
        levels=levels_of(selected.levels, settings.by),
    )
    interval = (
        share(settings.confidence, INTERVALS[settings.interval]) if settings.interval != "none" else "no interval"
    )
    kinds = {
        "n": "participants",
        "mean": "mean over participants of each participant's mean",
        "sd": "SD over participants of each participant's mean",
        "sd_interval": "SD that the interval is made from",
        "half": "half-width of the interval",
        "ci_low": interval,
        "ci_high": interval,
        "ratings_min": "ratings behind a participant's mean, least",
        "ratings_max": "ratings behind a participant's mean, most",
    }
    notes = [averaged_note(int(intervals["ratings_min"].min()), int(intervals["ratings_max"].max()))]
    if groups and settings.interval in ("cousineau_morey", "loftus_masson"):
        notes.append(f"Intervals are made within each {' x '.join(groups)}.")
    method = f"Means and SDs over participants; {INTERVALS[settings.interval]}"
    return answer_of(selected, plain_rows(intervals), method, kinds, notes=notes)


def means_with_gaps(selected: Selected, settings: Means) -> Answer:
    """Return the means where cells are missing: a mean over participants is of the same stimuli, or left out."""
    refuse_averaging(selected, settings.by)
    return means(selected, settings)


def trends(selected: Selected, settings: Trends) -> Answer:
    """Return one row per outcome (attributes, then categories) and family, with level differences in `more`."""
    numeric = () if settings.numeric is None else (settings.numeric,)
    require_columns(selected.table, (settings.pooled, settings.families, *numeric))
    table, notes = complete_rows(selected, settings)
    slopes: list[Row] = []
    levels: list[Row] = []
    for of, outcome, cells in _followed(selected, settings, turned(table, settings.reversed, selected.scale)):
        result = cell_trends(
            cells,
            families_of(table, settings.pooled, settings.families, cells.level(settings.pooled)),
            steps_of(table, settings.pooled, settings.numeric),
            reference=settings.reference,
            correction=settings.correction,
            size=settings.family,
            confidence=settings.confidence,
        )
        slopes += [{"outcome": outcome, "of": of, **row} for row in plain_rows(result.slopes)]
        levels += [
            {"outcome": outcome, "of": of, "reference": result.reference, **row} for row in plain_rows(result.levels)
        ]
    step = f"unit of {settings.numeric}" if settings.numeric else "step in the order of the levels"
    kinds = {**sample_kinds(settings.confidence, settings.correction), "levels": "levels of the family"}
    kinds["mean"] = f"mean over participants of the slope per {step}; mean difference from the reference"
    notes.append("A family of tests is the slopes of one outcome, and again its levels against the reference.")
    method = (
        "Least-squares slope of each participant over a family's levels; Student's t of the slopes over participants."
        " A category is the mean over its attributes, each counting equally. Against the reference: paired t"
    )
    more = {"against_reference": tuple(levels)} if levels else {}
    notes += turned_note(settings.reversed, selected)
    return answer_of(selected, slopes, method, kinds, table=table, notes=notes, more=more)


def _followed(selected: Selected, settings: Trends, table: pd.DataFrame) -> Iterator[tuple[str, str, PersonCells]]:
    """Yield the participants' means at each level, for every attribute, then for every category."""
    columns = ("attribute", settings.pooled)
    yield from _parts("attribute", person_cells(table, columns, levels=selected.levels), selected.outcomes)
    if settings.category == "none" or not selected.categories:
        return
    if lacking := [name for name in selected.outcomes if name not in selected.categories]:
        raise DataRefused(
            f"no category is declared for {some(lacking)}; say `category` in the study's attributes, or"
            " `category: none` in the plan"
        )
    cells = category_cells(table, selected.categories, (settings.pooled,), levels=selected.levels)
    yield from _parts("category", cells, tuple(dict.fromkeys(selected.categories.values())))


def _parts(of: str, cells: PersonCells, order: Sequence[str]) -> Iterator[tuple[str, str, PersonCells]]:
    for name in sorted(set(cells.level(of)), key=order.index):
        part = cells.only([j for j, cell in enumerate(cells.cells) if cell[0] == name])
        yield of, name, part.without(of)


def target_error(selected: Selected, settings: TargetErrors) -> Answer:
    """Return mean absolute errors: by attribute and end, by attribute, by category, and overall."""
    require_columns(selected.table, (settings.attribute_column, settings.target))
    table, notes = complete_rows(selected, settings)
    errors = target_errors(
        table,
        target=settings.target,
        attribute_column=settings.attribute_column,
        scale=selected.scale,
        target_scale=settings.target_scale,
        categories=selected.categories,
        confidence=settings.confidence,
        levels={"attribute": selected.outcomes},
    )
    kinds = sample_kinds(settings.confidence, "none")
    kinds = {name: kinds[name] for name in ("n", "sd", "ci_low", "ci_high")} | {
        "mean_absolute_error": "mean over participants of |rating - target|",
        "bias": "mean over participants of rating - target",
        "t": "paired t, for the difference of categories alone",
        "df": "degrees of freedom of that t",
        "p": "two-sided p of that t, not adjusted",
    }
    used = table[table["attribute"].astype(str) == table[settings.attribute_column].astype(str)]
    method = (
        "|rating - target| on the attribute that the stimulus was made for; trials averaged within an end, ends within"
        " an attribute, attributes within a category, attributes over all, each counting equally; Student's interval"
    )
    rows = [_error_row(mean_error) for mean_error in errors]
    means = [
        f"{mean_error.attribute} {number(mean_error.error.mean)}, {share(settings.confidence, 'CI')}"
        f" [{number(mean_error.error.low)}, {number(mean_error.error.high)}]"
        for mean_error in errors
        if mean_error.of in (CATEGORY, ALL) and mean_error.error.n > 1
    ]
    tested = [mean_error.error for mean_error in errors if mean_error.of == "difference" and mean_error.error.n > 1]
    between = [
        f"categories compared: t({mean_error.df:g}) = {number(mean_error.t)}, {apa_p(mean_error.p)}"
        for mean_error in tested
        if not mean_error.note
    ]
    return answer_of(
        selected,
        rows,
        method,
        kinds,
        table=used,
        headline=f"Mean absolute error: {'; '.join([*means, *between])}." if means else "",
        notes=notes,
    )


def _error_row(target_error: TargetError) -> Row:
    numbers = columns_of(target_error.error)
    test = {name: numbers[name] if target_error.of == "difference" else None for name in ("t", "df", "p")}
    undefined = target_error.error.note if target_error.error.n < 2 or target_error.of == "difference" else ""
    return plain_row(
        {
            "of": target_error.of,
            "attribute": target_error.attribute,
            "end": target_error.end or None,
            "target": target_error.target,
            "n": target_error.error.n,
            "mean_absolute_error": target_error.error.mean,
            "sd": target_error.error.sd,
            "ci_low": target_error.error.low,
            "ci_high": target_error.error.high,
            "bias": target_error.bias.mean,
            **test,
            "note": undefined,
        }
    )


Pair = tuple[str, str]


def categories(selected: Selected, settings: Categories) -> Answer:
    """Return mean ratings and SDs between participants of two categories, by level and attribute in `more`."""
    require_columns(selected.table, (*settings.by, *settings.over))
    pair = two_categories(selected.categories, selected.outcomes)
    table, notes = complete_rows(selected, settings)
    table = turned(table, settings.reversed, selected.scale)
    cells = category_cells(table, selected.categories, settings.by, levels=selected.levels)
    spread = disagreement(table, selected.categories, pair, over=settings.over, confidence=settings.confidence)
    if spread.left_out:
        notes.append(f"{spread.left_out} cells with fewer than three participants take no part in the SDs.")
    within = " x ".join(settings.over)
    method = (
        f"Mean over each category's attributes, each counting equally: {pair[1]} minus {pair[0]}, paired t over"
        f" participants. SD between participants: root of the mean variance within attribute x {within}; its ratio by"
        " the jackknife over participants of its logarithm (Miller 1968)"
    )
    spreads = attribute_spreads(table, settings.over)
    # Both categories' means at each level, and their difference with its p corrected over the levels.
    differences = category_differences(cells, pair, settings.confidence)
    corrected = adjusted([difference.p for _, difference in differences], CORRECTIONS[settings.correction])
    rows = []
    for (label, difference), p in zip(differences, corrected, strict=True):
        sides = {name: float(np.nanmean(cells.values[:, cells.cells.index((name, *label))])) for name in pair}
        numbers = {"difference" if name == "mean" else name: value for name, value in columns_of(difference).items()}
        corrected_p = {"p_corrected": p, "family_size": len(differences), "note": difference.note}
        rows.append(plain_row({**dict(zip(settings.by, label, strict=True)), **sides, **numbers, **corrected_p}))
    more = {
        "levels": tuple(rows),
        "category_x_level": tuple(_interaction(cells)),
        "attributes": tuple(
            plain_row({"attribute": name, "category": selected.categories[name], "sd": spreads[name]})
            for name in selected.outcomes
        ),
    }
    return answer_of(
        selected,
        _rows(cells, spread, pair, settings),
        method,
        _kinds(pair, within, settings.confidence),
        table=table,
        headline=_headline(spread, pair, settings.confidence),
        notes=[*notes, *turned_note(settings.reversed, selected)],
        more=more,
    )


def _rows(cells: PersonCells, spread: Disagreement, pair: Pair, settings: Categories) -> list[Row]:
    whole = overall(cells)
    ((_, mean),) = category_differences(whole, pair, settings.confidence)
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


def _interaction(cells: PersonCells) -> list[Row]:
    """Return the analysis of variance of category x levels, or the reason why there is none."""
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

"""The answers about means, trends and errors of targets, from the rows that a test is asked about."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palpate.analysis.plans.asking.describing_rows import (
    answer_of,
    averaged_note,
    complete_rows,
    plain_row,
    plain_rows,
    require_columns,
    sample_kinds,
    share,
    turned_note,
)
from palpate.analysis.ratings.categories import category_cells, turned
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.ratings.one_sample import columns_of
from palpate.analysis.ratings.person_cells import PersonCells, constant_columns, levels_of, person_cells
from palpate.analysis.ratings.target_errors import ALL, CATEGORY, TargetError, target_errors
from palpate.analysis.ratings.trends import cell_trends, families_of, steps_of
from palpate.analysis.ratings.within_intervals import mean_intervals
from palpate.analysis.statistics.apa import apa_p, number
from palpate.protocols.wording import some

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pandas as pd

    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.asking.describing import Means, TargetErrors, Trends

INTERVALS = {
    "cousineau_morey": "within-participant interval (Cousineau 2005, corrected by Morey 2008)",
    "loftus_masson": "pooled within-participant interval (Loftus & Masson 1994)",
    "between": "Student's interval of each mean over participants",
    "none": "no interval",
}


def means(selected: Selected, asked: Means) -> Answer:
    """One row per cell: mean and SD over participants, and the interval that is asked for."""
    require_columns(selected.table, asked.by)
    groups = constant_columns(selected.table, asked.by)
    found = mean_intervals(
        selected.table,
        by=asked.by,
        between=groups,
        method=asked.interval,
        confidence=asked.confidence,
        levels=levels_of(selected.levels, asked.by),
    )
    interval = share(asked.confidence, INTERVALS[asked.interval]) if asked.interval != "none" else "no interval"
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
    notes = [averaged_note(int(found["ratings_min"].min()), int(found["ratings_max"].max()))]
    if groups and asked.interval in ("cousineau_morey", "loftus_masson"):
        notes.append(f"Intervals are made within each {' x '.join(groups)}.")
    method = f"Means and SDs over participants; {INTERVALS[asked.interval]}"
    return answer_of(selected, plain_rows(found), method, kinds, notes=notes)


def trends(selected: Selected, asked: Trends) -> Answer:
    """One row per outcome (attributes, then categories) and family; the levels against the reference beside."""
    numeric = () if asked.numeric is None else (asked.numeric,)
    require_columns(selected.table, (asked.pooled, asked.families, *numeric))
    table, notes = complete_rows(selected, asked)
    slopes: list[Row] = []
    levels: list[Row] = []
    for of, outcome, cells in _followed(selected, asked, turned(table, asked.reversed, selected.scale)):
        found = cell_trends(
            cells,
            families_of(table, asked.pooled, asked.families, cells.level(asked.pooled)),
            steps_of(table, asked.pooled, asked.numeric),
            reference=asked.reference,
            correction=asked.correction,
            size=asked.family,
            confidence=asked.confidence,
        )
        slopes += [{"outcome": outcome, "of": of, **row} for row in plain_rows(found.slopes)]
        levels += [
            {"outcome": outcome, "of": of, "reference": found.reference, **row} for row in plain_rows(found.levels)
        ]
    step = f"unit of {asked.numeric}" if asked.numeric else "step in the order of the levels"
    kinds = {**sample_kinds(asked.confidence, asked.correction), "levels": "levels of the family"}
    kinds["mean"] = f"mean over participants of the slope per {step}; mean difference from the reference"
    notes.append("A family of tests is the slopes of one outcome, and again its levels against the reference.")
    method = (
        "Least-squares slope of each participant over a family's levels; Student's t of the slopes over participants."
        " A category is the mean over its attributes, each counting equally. Against the reference: paired t"
    )
    more = {"against_reference": tuple(levels)} if levels else {}
    notes += turned_note(asked.reversed, selected)
    return answer_of(selected, slopes, method, kinds, table=table, notes=notes, more=more)


def _followed(selected: Selected, asked: Trends, table: pd.DataFrame) -> Iterator[tuple[str, str, PersonCells]]:
    """The participants' means at each level: of every attribute, then of every category."""
    columns = ("attribute", asked.pooled)
    yield from _parts("attribute", person_cells(table, columns, levels=selected.levels), selected.outcomes)
    if asked.category == "none" or not selected.categories:
        return
    if lacking := [name for name in selected.outcomes if name not in selected.categories]:
        raise DataRefused(
            f"no category is declared for {some(lacking)}; say `category` in the study's attributes, or"
            " `category: none` in the plan"
        )
    cells = category_cells(table, selected.categories, (asked.pooled,), levels=selected.levels)
    yield from _parts("category", cells, tuple(dict.fromkeys(selected.categories.values())))


def _parts(of: str, cells: PersonCells, order: Sequence[str]) -> Iterator[tuple[str, str, PersonCells]]:
    for name in sorted(set(cells.level(of)), key=order.index):
        part = cells.only([j for j, cell in enumerate(cells.cells) if cell[0] == name])
        yield of, name, part.without(of)


def target_error(selected: Selected, asked: TargetErrors) -> Answer:
    """Mean absolute errors: per attribute and end, per attribute, per category, over all."""
    require_columns(selected.table, (asked.attribute_column, asked.target))
    table, notes = complete_rows(selected, asked)
    found = target_errors(
        table,
        target=asked.target,
        attribute_column=asked.attribute_column,
        scale=selected.scale,
        target_scale=asked.target_scale,
        categories=selected.categories,
        confidence=asked.confidence,
        levels={"attribute": selected.outcomes},
    )
    kinds = sample_kinds(asked.confidence, "none")
    kinds = {name: kinds[name] for name in ("n", "sd", "ci_low", "ci_high")} | {
        "mean_absolute_error": "mean over participants of |rating - target|",
        "bias": "mean over participants of rating - target",
        "t": "paired t, for the difference of categories alone",
        "df": "degrees of freedom of that t",
        "p": "two-sided p of that t, not adjusted",
    }
    used = table[table["attribute"].astype(str) == table[asked.attribute_column].astype(str)]
    method = (
        "|rating - target| on the attribute that the stimulus was made for; trials averaged within an end, ends within"
        " an attribute, attributes within a category, attributes over all, each counting equally; Student's interval"
    )
    rows = [_error_row(each) for each in found]
    return answer_of(
        selected, rows, method, kinds, table=used, headline=_error_headline(found, asked.confidence), notes=notes
    )


def _error_row(each: TargetError) -> Row:
    numbers = columns_of(each.error)
    test = {name: numbers[name] if each.of == "difference" else None for name in ("t", "df", "p")}
    undefined = each.error.note if each.error.n < 2 or each.of == "difference" else ""
    return plain_row(
        {
            "of": each.of,
            "attribute": each.attribute,
            "end": each.end or None,
            "target": each.target,
            "n": each.error.n,
            "mean_absolute_error": each.error.mean,
            "sd": each.error.sd,
            "ci_low": each.error.low,
            "ci_high": each.error.high,
            "bias": each.bias.mean,
            **test,
            "note": undefined,
        }
    )


def _error_headline(found: Sequence[TargetError], confidence: float) -> str:
    told = [
        f"{each.attribute} {number(each.error.mean)}, {share(confidence, 'CI')}"
        f" [{number(each.error.low)}, {number(each.error.high)}]"
        for each in found
        if each.of in (CATEGORY, ALL) and each.error.n > 1
    ]
    tested = [each.error for each in found if each.of == "difference" and each.error.n > 1]
    between = [
        f"categories compared: t({each.df:g}) = {number(each.t)}, {apa_p(each.p)}" for each in tested if not each.note
    ]
    return f"Mean absolute error: {'; '.join([*told, *between])}." if told else ""

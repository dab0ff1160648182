"""Means over participants with intervals that exclude, or include, differences between participants."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
import pandas as pd

from palpate.analysis.ratings.one_sample import check_confidence
from palpate.analysis.ratings.person_cells import (
    NO_LEVELS,
    Label,
    Levels,
    PersonCells,
    complete_people,
    person_cells,
)
from palpate.analysis.statistics.doubles import Floats, centred, differences
from palpate.analysis.statistics.f_and_t import t_critical
from palpate.analysis.statistics.refusals import (
    BadOption,
    DuplicatedCells,
    TooFew,
    listed,
    refuse_idle,
    refuse_idle_levels,
    shown,
)

Interval: TypeAlias = Literal["cousineau_morey", "loftus_masson", "between", "none"]
Row: TypeAlias = dict[str, object]
WITHIN = ("cousineau_morey", "loftus_masson")
NAN = math.nan


class _Half(NamedTuple):
    """The SD that an interval is computed from, the interval's half-width, and the reason if it has none."""

    sd: float
    half: float
    note: str = ""


def mean_intervals(
    data: pd.DataFrame,
    dv: str = "value",
    *,
    by: Sequence[str],
    subject: str = "participant",
    between: Sequence[str] = (),
    method: Interval = "cousineau_morey",
    confidence: float = 0.95,
    missing: Literal["raise", "listwise"] = "raise",
    levels: Levels = NO_LEVELS,
) -> pd.DataFrame:
    """Return one row per cell of `by`: n, mean, sd, sd_interval, half, ci_low, ci_high, ratings_min, ratings_max, note.

    Each participant's values in a cell are averaged first; n, mean and sd are over participants. `between` names the
    columns of `by` that define groups of participants: every interval is within one group. The interval is mean ±
    `half`: - `cousineau_morey`: from each participant's values minus their own mean, the variance times M / (M - 1) for
    M cells within participants, t with n - 1 df (Cousineau 2005, corrected by Morey 2008, Tutor. Quant. Methods
    Psychol. 4). - `loftus_masson`: sqrt(MS / n) of the participant x cell interaction, one width for all cells of a
    group, t with (n - 1)(M - 1) df (Loftus & Masson 1994, Psychon. Bull. Rev. 1). - `between`: from the SD over
    participants, t with n - 1 df, participants who lack the cell left out of it. - `none`: no interval. `sd_interval`
    is the SD that it was computed from. Undefined numbers are NaN with a note. Raises IncompleteCells where a
    within-participant interval meets a gap (unless `missing="listwise"`), DuplicatedCells for a participant in two
    groups, TooFew where nobody is left, BadOption, UnknownColumn, BadValue.
    """
    if method not in get_args(Interval):
        raise BadOption(f"interval {shown(method)} is unknown: one of {', '.join(get_args(Interval))}")
    check_confidence(confidence)
    if method == "none":
        refuse_idle("confidence", confidence, 0.95, "with method='none': there is no interval")
    if method not in WITHIN:
        refuse_idle(
            "missing", missing, "raise", f"with method={method!r}: a participant's only missing value is the cell"
        )
    refuse_idle_levels(levels, by)
    if unknown := [name for name in between if name not in by]:
        raise BadOption(f"between {unknown!r}: these columns are not among by={list(by)!r}")
    cells = person_cells(data, by, dv=dv, subject=subject, levels=levels)
    rows: dict[Label, Row] = {}
    for group in _groups(cells, between):
        rows |= dict(zip(group.cells, _group_rows(group, method, confidence, missing), strict=True))
    table = pd.DataFrame([rows[cell] for cell in cells.cells])
    table.attrs["participants"] = len(cells.participants)
    return table


def _groups(cells: PersonCells, between: Sequence[str]) -> list[PersonCells]:
    """Return the cells of each group with the participants who have a value there."""
    columns = [cells.level(name) for name in between]
    labels = list(zip(*columns, strict=True)) if columns else [()] * len(cells.cells)
    seen = ~np.isnan(cells.values)
    groups, owners = [], np.zeros(len(cells.participants), dtype=int)
    for label in dict.fromkeys(labels):
        here = [j for j, other in enumerate(labels) if other == label]
        people = np.flatnonzero(seen[:, here].any(axis=1)).tolist()
        owners[people] += 1
        groups.append(cells.only(here, people))
    twice = [cells.participants[i] for i in np.flatnonzero(owners > 1)]
    if twice:
        raise DuplicatedCells(
            f"participants in more than one group of {', '.join(between)}: {listed(twice, len(twice))};"
            " take the column out of `between`"
        )
    return groups


def _group_rows(
    group: PersonCells, method: Interval, confidence: float, missing: Literal["raise", "listwise"]
) -> list[Row]:
    if method in WITHIN:
        people = complete_people(group, missing)
        if not people:
            raise TooFew("no participant has a value in every cell; nobody is left listwise")
        group = group.only(range(len(group.cells)), people)
    halves = _halves(group.values, method, confidence)
    rows = []
    for j, half in enumerate(halves):
        there = ~np.isnan(group.values[:, j])
        values = np.sort(group.values[there, j]).tolist()
        counts = group.counts[there, j]
        mean = statistics.mean(values) if values else NAN
        rows.append(
            {
                **dict(zip(group.by, group.cells[j], strict=True)),
                "n": len(values),
                "mean": mean,
                "sd": statistics.stdev(values) if len(values) > 1 else NAN,
                "sd_interval": half.sd,
                "half": half.half,
                "ci_low": mean - half.half,
                "ci_high": mean + half.half,
                "ratings_min": int(counts.min(initial=counts.max(initial=0))),
                "ratings_max": int(counts.max(initial=0)),
                "note": half.note or ("one participant has no spread" if len(values) == 1 else ""),
            }
        )
    return rows


def _halves(values: Floats, method: Interval, confidence: float) -> list[_Half]:
    """Return the interval of every cell from the array (participants, cells) of one group."""
    n, m = values.shape
    if method == "none":
        return [_Half(NAN, NAN)] * m
    if method == "between":
        return [_student(column[~np.isnan(column)], confidence) for column in values.T]
    if n < 2:
        return [_Half(NAN, NAN, "one participant has no spread")] * m
    if m < 2:
        return [_Half(NAN, NAN, "one cell within participants has no within-participant interval")]
    # Each participant's values minus their own mean: differences first, so that no offset costs a digit.
    high, low = differences((values, None), 1)
    change: Floats = high if low is None else high + low
    own: Floats = centred(change, 1) / values.shape[1]
    if method == "loftus_masson":
        # One width for all cells, from the mean square of the participant x cell interaction.
        high, low = differences((own, None), 0)
        rest = centred(high if low is None else high + low, 0) / n
        df = (n - 1) * (m - 1)
        sd = math.sqrt(math.fsum((rest * rest).ravel().tolist()) / df)
        return [_Half(sd, t_critical(df, confidence) * sd / math.sqrt(n))] * m
    factor = math.sqrt(m / (m - 1))
    return [_student(column * factor, confidence) for column in own.T]


def _student(values: Floats, confidence: float) -> _Half:
    if len(values) < 2:
        return _Half(NAN, NAN, "one participant has no spread" if len(values) else "no participant has a value here")
    sd = statistics.stdev(np.sort(values).tolist())
    return _Half(sd, t_critical(len(values) - 1, confidence) * sd / math.sqrt(len(values)))

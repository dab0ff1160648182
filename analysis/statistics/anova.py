"""Repeated-measures ANOVA with any number of factors within participants, and one-way ANOVA between groups;
the corrections of Greenhouse and Geisser and of Huynh and Feldt for a lack of sphericity.

Every sum of squares is that of differences: the table is differenced against its first level (and participant), so
that an offset of 1e12 costs no digit, and only then summed, centred and squared. docs/reference/statistics.md has
the formulas.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from pandas.api.internals import create_dataframe_from_blocks  # type: ignore[import-not-found]

from palpate.analysis.statistics.cells import Aggregate, Cells, Missing, gather
from palpate.analysis.statistics.doubles import (
    ROUNDING,
    Floats,
    Pair,
    centred,
    deviation_ss,
    differences,
    exact_sum,
    rescaled,
    row_sums,
    scaled,
    sum_of_squares,
)
from palpate.analysis.statistics.f_and_t import f_tail, p_note
from palpate.analysis.statistics.groups import gather_groups
from palpate.analysis.statistics.refusals import TooFew, UnknownColumn, listed

COLUMNS = pd.Index(
    [
        *("Source", "SS", "ddof1", "ddof2", "MS", "F", "p_unc", "p_GG_corr", "p_HF_corr"),
        *("eps", "np2", "ng2", "eps_HF", "SS_error", "note"),
    ],
    dtype="str",
)
SOURCE, INTEGERS, REALS, NOTE = (np.array(places) for places in ([0], [2, 3], [1, *range(4, 14)], [14]))


def rm_anova(
    data: pd.DataFrame,
    dv: Hashable,
    within: Hashable | Iterable[Hashable],
    subject: Hashable,
    *,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return the repeated-measures ANOVA of a long table: one row per effect, pingouin's column names.

    `within` is a factor or a list of factors; `Source` joins their names with ":". `eps` is Greenhouse-Geisser's,
    `eps_HF` Huynh-Feldt's at most 1, `np2` partial and `ng2` generalized eta squared, `note` says why a value is NaN.
    Every participant must have one value in every cell: `missing="listwise"` leaves the others out and
    `aggregate="mean"` averages repetitions; the result's `attrs` say whom and how many.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    cells = gather(data, dv, within, subject, missing, aggregate)
    refuse_too_few(cells)
    table = effects_table(list(effects(cells.values, sources(cells.factors))))
    table.attrs.update(cells.attrs())
    return table


def anova(
    data: pd.DataFrame,
    dv: Hashable,
    between: Hashable | Iterable[Hashable],
    *,
    subject: Hashable | None = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return the one-way ANOVA between groups of a long table: one row, pingouin's column names.

    Without `subject` every row is an independent value. `np2` (partial) and `eta2` (classical) eta squared are the same
    number in a one-way design; `note` says why a value is NaN. `missing="listwise"` leaves out rows without a value,
    `aggregate="mean"` averages each participant's values.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    groups = gather_groups(data, dv, between, subject, missing, aggregate)
    table = pd.DataFrame([{"Source": str(groups.factor), **one_way(groups.values)}])
    table.attrs.update(groups.attrs())
    return table


def sources(factors: Sequence[Hashable]) -> list[str]:
    """Return the names of the effects, main effects first. Raises an error for equal names ("a:b" and "a" by "b")."""
    names = [":".join(str(factors[axis - 1]) for axis in axes) for axes in _subsets(len(factors))]
    if len(set(names)) < len(names):
        twice = sorted({repr(name) for name in names if names.count(name) > 1})
        raise UnknownColumn(
            f"two effects of the factors {', '.join(map(repr, factors))} have the same name: "
            f"{listed(twice, len(twice))}; rename a column"
        )
    return names


def refuse_too_few(cells: Cells) -> None:
    """Raise TooFew for a factor with one level and a table with one participant."""
    for name, levels in zip(cells.factors, cells.levels, strict=True):
        if len(levels) < 2:
            raise TooFew(f"factor {name!r} has one level, {levels[0]!r}; a comparison needs two or more")
    if len(cells.participants) < 2:
        left = f" ({len(cells.dropped)} left out for missing values)" if cells.dropped else ""
        raise TooFew(
            f"one participant, {cells.participants[0]!r}{left}; repeated measures need two or more participants"
        )


def effects(values: Floats, names: Sequence[str]) -> Iterator[Effect]:
    """Yield the effects of an array (participants, levels of factor 1, ...), one per name of `sources`."""
    x, exponent = scaled(values)
    plain: Pair = (x, None)
    by_subject = differences(plain, 0)
    subject_ss = component(by_subject, (0,), 0)[1]
    parts = []
    for source, axes in zip(names, _subsets(x.ndim - 1), strict=True):
        levels, effect_ss = [x.shape[axis] for axis in axes], component(plain, axes)[1]
        parts.append((source, levels, effect_ss, *component(by_subject, (0, *axes), 0)))
    within_ss = subject_ss + math.fsum(error_ss for *_, error_ss in parts)
    noise = x.size * ROUNDING**2
    n = len(x)
    for source, levels, effect_ss, residual, error_ss in parts:
        df1 = math.prod([level - 1 for level in levels])
        df2 = df1 * (n - 1)
        f = eps = eps_hf = math.nan
        notes = []
        if error_ss > noise:
            f = effect_ss / df1 / (error_ss / df2)
            eps = greenhouse_geisser(residual.reshape(n, -1), df1)
            eps_hf = huynh_feldt(eps, n, df1)
            if n - 1 < df1:
                few = f"fewer than d + 1 = {df1 + 1} participants"
                notes.append(f"{few}: Huynh-Feldt is undefined, use Greenhouse-Geisser")
        else:
            notes.append(undefined_f(effect_ss, error_ss, noise, "every participant shows the same effect"))
        p = f_tail(f, df1, df2)
        p_gg, p_hf = [p if e == 1 else f_tail(f, df1 * e, df2 * e) for e in (eps, eps_hf)]
        result, ms, result_error = [rescaled(value, 2 * exponent) for value in (effect_ss, effect_ss / df1, error_ss)]
        notes += range_notes(((effect_ss, result), (error_ss, result_error)), (p, p_gg, p_hf))
        np2, ng2 = share(effect_ss, error_ss, noise), share(effect_ss, within_ss, noise)
        yield Effect(
            *(source, result, df1, df2, ms, f, p, p_gg, p_hf),
            *(eps, np2, ng2, eps_hf, result_error, "; ".join(notes)),
        )


def _subsets(factors: int) -> Iterator[tuple[int, ...]]:
    for size in range(1, factors + 1):
        yield from combinations(range(1, factors + 1), size)


def component(pair: Pair, axes: Sequence[int], done: int | None = None) -> tuple[Floats, float]:
    """Return the part of a full factorial array that varies along all of these axes and no others.

    `pair` is the array, already differenced along axis `done`. Returns that part (times the sizes of its axes and
    summed over the others, so exact on integers) and its sum of squares. Winer, Brown & Michels 1991, ch. 7, in the
    order: difference, sum, centre, square.
    """
    for axis in axes:
        pair = pair if axis == done else differences(pair, axis)
    # The pair summed over all axes but these.
    high, low = pair
    others = [axis for axis in range(high.ndim) if axis not in axes]
    if not others:
        part = high if low is None else high + low
    else:
        shape = [high.shape[axis] for axis in axes]
        rows = (math.prod(shape), -1)
        high = high.transpose(*axes, *others).reshape(rows)
        low = None if low is None else low.transpose(*axes, *others).reshape(rows)
        part = row_sums((high, low)).reshape(shape)
    for axis in range(part.ndim):
        part = centred(part, axis)
    summed = pair[0].size / part.size
    return part, sum_of_squares(part) / summed / part.size**2


def greenhouse_geisser(residual: Floats, df: int) -> float:
    """Return epsilon of the doubly centred residuals (participants, cells): tr(S)^2 / (df tr(S^2)), in [1/df, 1].

    Greenhouse & Geisser 1959. S and the smaller of the two cross-product matrices have the same eigenvalues.
    """
    if df == 1:
        return 1.0
    n, k = residual.shape
    products = residual.T @ residual if k <= n else residual @ residual.T
    trace = float(products.trace())
    return min(1.0, max(1 / df, trace / sum_of_squares(products) * trace / df))


def huynh_feldt(eps: float, n: int, df: int) -> float:
    """Return Huynh & Feldt's 1976 epsilon for one group, at most 1; NaN with fewer than df + 1 participants."""
    if df == 1:
        return 1.0
    if n - 1 < df:
        return math.nan
    room = df * (n - 1 - df * eps)
    return 1.0 if room <= 0 else min(1.0, (n * df * eps - 2) / room)


def undefined_f(effect_ss: float, error_ss: float, noise: float, reason: str) -> str:
    """Return why F is undefined, or "": a residual of zero, or one that is only rounding."""
    if error_ss > noise:
        return ""
    level = "has no variation" if error_ss == 0 else "is at the rounding level of the data"
    if effect_ss <= noise:
        return f"F is undefined: the residual {level} and there is no effect"
    return f"F is undefined: the residual {level} ({reason})"


def share(effect_ss: float, rest_ss: float, noise: float) -> float:
    """Return effect / (effect + rest), NaN if both are only rounding."""
    total = effect_ss + rest_ss
    return effect_ss / total if total > noise else math.nan


def range_notes(sums: Iterable[tuple[float, float]], p_values: Iterable[float]) -> list[str]:
    """Return notes on values that overflow double precision although the statistics are valid."""
    notes = []
    if any(math.isinf(result) or (result == 0 and exact > 0) for exact, result in sums):
        notes.append("sums of squares exceed the range of double precision")
    if note := p_note(p_values):
        notes.append(note)
    return notes


class Effect(NamedTuple):
    """One row of the table; sums of squares are in the data's unit squared, NaN if a statistic is undefined."""

    source: str
    ss: float
    df1: int
    df2: int
    ms: float
    f: float
    p: float
    p_gg: float
    p_hf: float
    eps: float
    np2: float
    ng2: float
    eps_hf: float
    ss_error: float
    note: str


def effects_table(rows: Sequence[Effect]) -> pd.DataFrame:
    """Return the table of `rm_anova`, assembled from blocks: the usual constructor takes longer than the test.

    A block is a 2-D array with a row per column of the table, or a column of text.
    """
    source, ss, df1, df2, *reals, note = zip(*rows, strict=True)
    blocks = [
        (_text(source), SOURCE),
        (np.array((df1, df2), dtype=np.int64), INTEGERS),
        (np.array((ss, *reals), dtype=np.float64), REALS),
        (_text(note), NOTE),
    ]
    table: pd.DataFrame = create_dataframe_from_blocks(blocks, pd.RangeIndex(len(rows)), COLUMNS.view())
    return table


def _text(values: tuple[str, ...]) -> Any:
    return _cached_text(values).copy()  # the caller may change the table


@lru_cache(maxsize=256)
def _cached_text(values: tuple[str, ...]) -> Any:
    """Return a column of text, cached since creating one takes long and reports need the same ones repeatedly."""
    return pd.array(list(values), dtype="str")


def one_way(groups: Sequence[Floats]) -> dict[str, float | int | str]:
    """Return the statistics of a list of groups, by the names of the table's columns."""
    sizes = [len(group) for group in groups]
    x, exponent = scaled(np.concatenate(groups))
    parts = np.split(x, np.cumsum(sizes)[:-1])
    # sum T_g^2 / n_g - T^2 / N in exact rationals: few enough sums to afford it, and it cancels without loss.
    pivot = float(x[0])
    totals = [exact_sum(part, pivot) for part in parts]
    squares = sum((total**2 / len(part) for total, part in zip(totals, parts, strict=True)), Fraction(0))
    ssb, ssw = (
        float(squares - sum(totals, Fraction(0)) ** 2 / sum(map(len, parts))),
        math.fsum(map(deviation_ss, parts)),
    )
    df1, df2 = len(groups) - 1, len(x) - len(groups)
    noise = x.size * ROUNDING**2
    note = undefined_f(ssb, ssw, noise, "the values of each group are the same")
    f = math.nan if note else ssb / df1 / (ssw / df2)
    p, eta2 = f_tail(f, df1, df2), share(ssb, ssw, noise)
    ss, ms, ss_error = (rescaled(value, 2 * exponent) for value in (ssb, ssb / df1, ssw))
    notes = [note] * bool(note) + range_notes(((ssb, ss), (ssw, ss_error)), (p,))
    return {
        **{"SS": ss, "ddof1": df1, "ddof2": df2, "MS": ms, "F": f, "p_unc": p, "np2": eta2, "eta2": eta2},
        **{"SS_error": ss_error, "note": "; ".join(notes)},
    }

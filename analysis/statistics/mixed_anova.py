"""ANOVA with factors within and between participants, types II and III, and Mauchly's test of sphericity.

Within participants every sum of squares is that of differences (`anova.component`), computed in each group separately;
between groups it is a quadratic form of the groups' sums in exact integers (`hypotheses`).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from palpate.analysis.statistics.anova import (
    Effect,
    component,
    effects_table,
    greenhouse_geisser,
    huynh_feldt,
    range_notes,
    refuse_too_few,
    share,
    undefined_f,
)
from palpate.analysis.statistics.cells import Aggregate, Cells, Missing, check_columns, gather_all, name_list
from palpate.analysis.statistics.doubles import ROUNDING, Floats, differences, rescaled, scaled
from palpate.analysis.statistics.f_and_t import SMALLEST, f_tail, p_note
from palpate.analysis.statistics.groups import Membership, membership
from palpate.analysis.statistics.hypotheses import SumOfSquares, group_sums, subsets
from palpate.analysis.statistics.refusals import (
    NO_SUBJECT,
    BadOption,
    TooFew,
    UnknownColumn,
    listed,
    refuse_idle,
    shown,
)

Names = Hashable | Iterable[Hashable] | None
SAME_TYPES = "factors within participants alone, or of one factor between them: types II and III are the same"
COLUMNS = ("Source", "d", "W", "chi2", "ddof", "p", "p_anderson", "note")


def mixed_anova(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Names = None,
    between: Names = None,
    subject: Hashable | None = None,
    sum_of_squares: SumOfSquares = "III",
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return the ANOVA of a long table with factors within participants, between them, or both: one row per effect.

    The columns are those of `rm_anova`, and `d`, the effect's number of contrasts within participants (1 for an effect
    between participants, whose epsilon is 1). With groups of different sizes `sum_of_squares` matters: "III" compares
    unweighted means (sum-to-zero contrasts), "II" adjusts each effect for all that do not contain it, both as R's car
    and afex do. `eps_HF` has Lecoutre's correction for groups, at most 1, as in car. `ng2` counts every factor as
    manipulated. `subject` may be left out without a within factor; each row is then a participant. Raises a
    StatisticsError (a ValueError) that names what is wrong with the table.
    """
    refuse_unknown_type(sum_of_squares, within, between)
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    effects = list(mixed_effects(design, sum_of_squares))
    table = effects_table([effect for _, effect in effects])
    table.insert(len(table.columns) - 1, "d", [contrasts for contrasts, _ in effects])
    sizes = dict(zip(design.groups.names(), design.groups.sizes, strict=True))
    table.attrs.update(design.cells.attrs() | {"sum_of_squares": sum_of_squares, "group_sizes": sizes})
    return table


def refuse_unknown_type(sum_of_squares: object, within: Names, between: Names) -> None:
    """Raise BadOption for types of sums of squares other than II and III, and for II if it makes no difference.

    The two types differ for effects of groups that other factors divide, too.
    """
    if not isinstance(sum_of_squares, str) or sum_of_squares not in ("II", "III"):
        raise BadOption(f"sum_of_squares={shown(sum_of_squares)} is unknown: 'II' or 'III'")
    own, others = ([] if names is None else name_list(names) for names in (within, between))
    if not type_matters(len(own), len(others)):
        refuse_idle("sum_of_squares", sum_of_squares, "III", f"in a design of {SAME_TYPES}")


def type_matters(within: int, between: int) -> bool:
    """Return whether sums of squares of types II and III can differ with these numbers of factors."""
    return between > 1 or (between == 1 and within > 0)


@dataclass(frozen=True)
class Design:
    """One value per participant and within cell, and the groups of the participants."""

    cells: Cells
    groups: Membership

    @property
    def parts(self) -> list[Floats]:
        """The values of each group, in the unit of the data."""
        return [self.cells.values[group] for group in self.groups.groups]

    @property
    def error_df(self) -> int:
        """The number of participants minus the number of groups."""
        return len(self.cells.values) - len(self.groups.groups)

    def source(self, between: Sequence[int], axes: Sequence[int]) -> str:
        """Return an effect's name: its between factors, then its within factors."""
        own = [self.groups.factors[place] for place in between]
        return ":".join(map(str, [*own, *(self.cells.factors[axis - 1] for axis in axes)]))

    def terms(self) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Return every effect as (within axes, between factors by index), in the order of R's afex."""
        betweens = list(subsets(len(self.groups.factors)))
        axes = list(subsets(len(self.cells.factors), first=1))
        return [(own, other) for own in axes for other in betweens if own or other]


def gather_design(
    data: pd.DataFrame,
    dv: Hashable,
    within: Names,
    between: Names,
    subject: Hashable | None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> Design:
    """Return the dense values and the groups of a long table. Raises an error unless the design is complete."""
    own, others = ([] if names is None else name_list(names) for names in (within, between))
    if not own + others:
        raise BadOption("no factor is named; give `within`, `between` or both")
    nobodys = subject is None
    if subject is None:
        refuse_idle("aggregate", aggregate, None, NO_SUBJECT)
        if own:
            raise BadOption("within needs `subject`, the column of participants")
        check_columns(data, others)
        name = "row"
        while name in data.columns:
            name += "'"
        data, subject = data.assign(**{name: [f"row {row + 1}" for row in range(len(data))]}), name
    check_columns(data, [dv, subject, *own, *others])
    cells = gather_all(data, dv, own, subject, missing, aggregate)
    refuse_too_few(cells)
    if nobodys:  # rows are no participants, and no result may depend on their order: they go by their values
        order = np.argsort(cells.values, kind="stable")
        people = [cells.participants[i] for i in order.tolist()]
        cells = replace(cells, values=cells.values[order], participants=people)
    design = Design(cells, membership(data, cells, others, subject))
    names = [design.source(between, axes) for axes, between in design.terms()]
    if len(set(names)) < len(names):
        twice = sorted({repr(name) for name in names if names.count(name) > 1})
        raise UnknownColumn(f"two effects have the same name: {listed(twice, len(twice))}; rename a column")
    if design.error_df < 1:
        raise TooFew("every group has one participant; at least one group needs two or more")
    return design


@dataclass(frozen=True)
class Stratum:
    """The residuals of one set of within axes: sum of squares, epsilons and contrasts per participant."""

    axes: tuple[int, ...]
    d: int
    ss: float
    residual: Floats  # (participants, cells), scaled alike for every participant
    eps: float
    eps_hf: float


def strata(design: Design, x: Floats) -> Iterator[Stratum]:
    """Yield the residuals within groups for every set of within axes, the empty one (between participants) first.

    `x` are the design's values, scaled.
    """
    parts = [differences((x[group], None), 0) for group in design.groups.groups]
    for axes in subsets(x.ndim - 1, first=1):
        components = [component(part, (0, *axes), 0) for part in parts]
        rows = [residual.reshape(len(residual), -1) / len(residual) for residual, _ in components]
        d = math.prod(x.shape[axis] - 1 for axis in axes)
        ss, residual = math.fsum(ss for _, ss in components), np.concatenate(rows)
        eps = greenhouse_geisser(residual, d) if ss > x.size * ROUNDING**2 else math.nan
        yield Stratum(axes, d, ss, residual, eps, huynh_feldt(eps, design.error_df + 1, d))


def mixed_effects(design: Design, kind: SumOfSquares) -> Iterator[tuple[int, Effect]]:
    """Yield every effect with its number of within contrasts, in the order of `Design.terms`."""
    x, exponent = scaled(design.cells.values)
    sums = group_sums(x, design.groups, kind)
    errors = {stratum.axes: stratum for stratum in strata(design, x)}
    rest = math.fsum(stratum.ss for stratum in errors.values())
    noise = design.cells.values.size * ROUNDING**2
    for axes, between in design.terms():
        error = errors[axes]
        rank, exact_ss = sums.effect(between, axes)
        ss = float(exact_ss)
        df1, df2 = error.d * rank, error.d * design.error_df
        reason = "every participant of a group shows the same effect" if axes else "the values of each group are equal"
        notes = [note for note in (undefined_f(ss, error.ss, noise, reason),) if note]
        f = math.nan if notes else ss / df1 / (error.ss / df2)
        if design.error_df < error.d and not notes:
            few = f"fewer than d = {error.d} participants more than groups"
            notes.append(f"{few}: Huynh-Feldt is undefined, use Greenhouse-Geisser")
        p = f_tail(f, df1, df2)
        p_gg, p_hf = [p if e == 1 else f_tail(f, df1 * e, df2 * e) for e in (error.eps, error.eps_hf)]
        own, ms, own_error = [rescaled(value, 2 * exponent) for value in (ss, ss / df1, error.ss)]
        notes += range_notes(((ss, own), (error.ss, own_error)), (p, p_gg, p_hf))
        np2, ng2 = share(ss, error.ss, noise), share(ss, rest, noise)
        numbers = (own, df1, df2, ms, f, p, p_gg, p_hf, error.eps, np2, ng2, error.eps_hf, own_error)
        yield error.d, Effect(design.source(between, axes), *numbers, "; ".join(notes))


@dataclass(frozen=True)
class Sphericity:
    """A test of sphericity; `p` has R's second-order term, `p_anderson` that of the literature."""

    Source: str
    d: int
    W: float
    chi2: float
    ddof: int
    p: float
    p_anderson: float
    note: str


def mauchly_tests(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Names,
    subject: Hashable,
    between: Names = None,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return Mauchly's test (1940) of every set of within factors with two or more contrasts (`d`): one row each.

    W and p are those of R's `mauchly.test` and car: p is that of Box's chi-squared series with two terms, in whose
    second R 4.2 writes the number of all within cells where Anderson (2003, 10.7.2) has the number of contrasts;
    `p_anderson` has the latter. With between factors the covariance is pooled over groups. With fewer participants
    (minus groups) than contrasts there is no test: W and p are NaN and the `note` says so. Raises a StatisticsError as
    `mixed_anova` does.
    """
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    return pd.DataFrame([asdict(test) for test in sphericities(design)], columns=list(COLUMNS))


def sphericities(design: Design) -> Iterator[Sphericity]:
    """Yield the tests of a design, in the order of its within effects."""
    x, _ = scaled(design.cells.values)
    cells = math.prod(x.shape[1:])
    for stratum in strata(design, x):
        if stratum.d > 1:
            source = design.source((), stratum.axes)
            d = stratum.d
            ddof = d * (d + 1) // 2 - 1
            note, log_w = _log_w(stratum, design.error_df)
            if note:
                sphericity = Sphericity(source, d, math.nan, math.nan, ddof, math.nan, math.nan, note)
            else:
                rho = 1 - (2 * d * d + d + 2) / (6 * d * design.error_df)
                chi2 = -design.error_df * rho * log_w
                p, by_anderson = (_tail(chi2, d, design.error_df * rho, size) for size in (cells, d))
                w = max(math.exp(log_w), SMALLEST)
                sphericity = Sphericity(source, d, w, chi2, ddof, p, by_anderson, p_note((p, w)))
            yield sphericity


def _log_w(stratum: Stratum, n: int) -> tuple[str, float]:
    """Return log W = log det S - d log(tr S / d) of the contrasts' covariance S, or the reason why there is none."""
    d = stratum.d
    if n < d:
        return f"fewer than d = {d} participants more than groups: there is no test of sphericity", math.nan
    if math.isnan(stratum.eps):
        return "the residual has no variation: there is no test of sphericity", math.nan
    values = np.linalg.svd(stratum.residual, compute_uv=False)[:d].astype(np.float64)
    if values[-1] <= values[0] * max(stratum.residual.shape) * 2.0**-52:
        return "the covariance of the contrasts is singular: there is no test of sphericity", math.nan
    squares = (values / values[0]) ** 2
    return "", min(0.0, math.fsum(np.log(squares)) - d * math.log(math.fsum(squares) / d))


def _tail(chi2: float, d: int, room: float, size: int) -> float:
    """Return the tail of Box's chi-squared series with two terms; `size` is the number in the second term."""
    ddof = d * (d + 1) // 2 - 1
    second = (d + 2) * (d - 1) * (d - 2) * (2 * d**3 + 6 * d**2 + 3 * size + 2) / (288 * (d * room) ** 2)
    first, later = float(chdtrc(ddof, chi2)), float(chdtrc(ddof + 4, chi2))
    return min(1.0, max(first + second * (later - first), SMALLEST))

"""The aligned rank transform: a factorial analysis of variance on ranks, one alignment for each effect.

Each effect is tested on the ranks of the values after removal of all other effects: the residual from the cell's mean
plus this effect's own estimate, a signed sum of means (Higgins & Tashtoush 1994; Wobbrock, Findlater, Gergle & Higgins
2011). The analysis of variance is the one of `palpate.analysis.statistics.mixed_anova`.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from palpate.analysis.ordinal.ranks import WHOLE_END, doubled_ranks, refuse_huge
from palpate.analysis.statistics.cells import Aggregate, Missing, cell_means
from palpate.analysis.statistics.doubles import ROUNDING_ULPS, Floats
from palpate.analysis.statistics.hypotheses import SumOfSquares
from palpate.analysis.statistics.mixed_anova import Design, Names, gather_design, mixed_effects, refuse_unknown_type

Term: TypeAlias = tuple[int, ...]  # places of an effect's factors: between factors first, then within factors
CLEAN = 1e-9  # an F of an effect that was aligned away is at most this where alignment works


@dataclass(frozen=True)
class Aligned:
    """One effect's aligned values and their ranks, both with the shape of the design's cells."""

    source: str
    values: Floats
    ranks: Floats


def aligned_ranks(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Names = None,
    between: Names = None,
    subject: Hashable,
    sum_of_squares: SumOfSquares = "III",
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return an aligned rank transform ANOVA with any number of within and between factors: one row per effect.

    The columns are those of `mixed_anova` without the sums of squares, for the ranks aligned for that effect, then two
    checks of the alignment: `aligned_sum`, the sum of the aligned values relative to the sum of their sizes, and
    `other_F`, the largest F of any other effect in them. Both are 0 up to rounding with groups of equal size; with
    unequal groups alignment cannot separate the effects fully, and the note says how much is left. Raises a
    StatisticsError (a ValueError) that names what is wrong with the table.
    """
    refuse_unknown_type(sum_of_squares, within, between)
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    refuse_huge(design.cells.values)
    table = pd.DataFrame([_row(design, alignment, sum_of_squares) for alignment in alignments(design)])
    sizes = dict(zip(design.groups.names(), design.groups.sizes, strict=True))
    table.attrs.update(design.cells.attrs() | {"sum_of_squares": sum_of_squares, "group_sizes": sizes})
    return table


def aligned_table(
    data: pd.DataFrame,
    dv: Hashable,
    *,
    within: Names = None,
    between: Names = None,
    subject: Hashable,
    missing: Missing = "raise",
    aggregate: Aggregate = None,
) -> pd.DataFrame:
    """Return the aligned values ("aligned SOURCE") and ranks ("rank SOURCE") of every effect.

    One row per participant and cell.
    Raises a StatisticsError (a ValueError) that names what is wrong with the table.
    """
    design = gather_design(data, dv, within, between, subject, missing, aggregate)
    refuse_huge(design.cells.values)
    cells = design.cells
    where = np.indices(cells.values.shape).reshape(cells.values.ndim, -1)
    labels = [cells.participants, *cells.levels]
    columns: dict[Any, Any] = {
        name: [own[i] for i in axis] for name, own, axis in zip([subject, *cells.factors], labels, where, strict=True)
    }
    for alignment in alignments(design):
        columns[f"aligned {alignment.source}"] = alignment.values.ravel()
        columns[f"rank {alignment.source}"] = alignment.ranks.ravel()
    return pd.DataFrame(columns)


def alignments(design: Design) -> Iterator[Aligned]:
    """Yield every effect's alignment, in the order of the design's effects."""
    values = design.cells.values
    # Every factor's level in each value, and how many levels each factor has; between factors come first.
    shape, sizes = design.cells.values.shape, [len(levels) for levels in design.groups.levels]
    group = np.empty(shape[0], dtype=np.intp)
    for place, people in enumerate(design.groups.groups):
        group[people] = place
    own = np.unravel_index(group, sizes) if sizes else ()
    rest = math.prod(shape[1:])
    codes_between = [np.repeat(codes, rest).astype(np.intp) for codes in own]
    codes_within = [axis.ravel().astype(np.intp) for axis in np.indices(shape)[1:]]
    codes, sizes = [*codes_between, *codes_within], [*sizes, *shape[1:]]
    pivot = float(values.flat[0])
    y = values.ravel() - pivot
    # How far rounding may have moved a value: whole numbers are exact, whatever their offset.
    whole = bool((values % 1 == 0).all()) and float(np.abs(values).max()) <= WHOLE_END
    unsure = ROUNDING_ULPS * float(np.spacing(np.abs(y if whole else values).max()))
    count = len(design.groups.factors)
    means: dict[Term, Floats] = {}
    for axes, between in design.terms():
        term = (*between, *(count + axis - 1 for axis in axes))
        for part in _parts(tuple(range(len(sizes)))):
            if part not in means:
                # For every value the mean of all values with the same levels of these factors; of all for no
                # factor.
                own_codes = [codes[place] for place in part]
                own_sizes = [sizes[place] for place in part]
                flat = np.zeros(len(y), dtype=np.intp)
                for levels, size in zip(own_codes, own_sizes, strict=True):
                    flat = flat * size + levels
                counts = np.bincount(flat, minlength=math.prod(own_sizes))
                means[part] = cell_means(y, flat, counts)[flat]
        # An effect is a signed sum of means: AB = mean(AB) - mean(A) - mean(B) + mean.
        signed = ((-1) ** (len(term) - len(part)) * means[part] for part in _parts(term))
        effect = sum(signed, np.zeros_like(y))
        aligned = (y - means[tuple(range(len(sizes)))] + effect).reshape(values.shape)
        # Aligned values are tied where closer than the rounding of the means that they are made of.
        room = np.full((1, aligned.size), (2 + 2 ** len(term)) * unsure)
        ranks = doubled_ranks(aligned.reshape(1, -1), room, computed=True) / 2
        yield Aligned(design.source(between, axes), aligned, ranks.reshape(aligned.shape))


def _parts(term: Term) -> Iterator[Term]:
    for size in range(len(term) + 1):
        yield from combinations(term, size)


def _row(design: Design, alignment: Aligned, kind: SumOfSquares) -> dict[str, Any]:
    effects = mixed_effects(replace(design, cells=replace(design.cells, values=alignment.ranks)), kind)
    contrasts, effect = next((contrasts, effect) for contrasts, effect in effects if effect.source == alignment.source)
    # The largest F of an effect that was aligned away; 0 where nothing was, or where nothing varies.
    of_aligned = mixed_effects(replace(design, cells=replace(design.cells, values=alignment.values)), kind)
    others = [effect.f for _, effect in of_aligned if effect.source != alignment.source and not math.isnan(effect.f)]
    left = max(others, default=0.0)
    size = float(np.abs(alignment.values).sum())
    notes = [effect.note]
    if left > CLEAN:
        notes.append(f"groups of unequal size: alignment leaves F = {left:.2g} of another effect")
    return {
        **{"Source": alignment.source, "ddof1": effect.df1, "ddof2": effect.df2, "F": effect.f, "p_unc": effect.p},
        **{"p_GG_corr": effect.p_gg, "p_HF_corr": effect.p_hf, "eps": effect.eps, "eps_HF": effect.eps_hf},
        **{"np2": effect.np2, "ng2": effect.ng2, "d": contrasts},
        "aligned_sum": abs(math.fsum(alignment.values.ravel().tolist())) / size if size else 0.0,
        "other_F": left,
        "note": "; ".join(filter(None, notes)),
    }

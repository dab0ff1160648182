"""The answers about pairs of levels: do they differ, and are they equivalent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from palpate.analysis.plans.asking.describing_rows import answer_of, plain_row, require_columns, share
from palpate.analysis.plans.asking.variance_anova import made_of, used
from palpate.analysis.statistics.apa import number
from palpate.analysis.statistics.equivalence import equivalence_tests
from palpate.analysis.statistics.pair_order import pairs_in_order
from palpate.analysis.statistics.pairwise import pairwise_tests

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.plans.answers import Answer, Asked, Row, Selected
    from palpate.analysis.plans.asking.variance import Equivalence, Pairs

CORRECTED = {"bonferroni": "Bonferroni", "holm": "Holm", "none": "not adjusted"}
TOLD = 6


def pairs_answer(selected: Selected, asked: Pairs) -> Answer:
    """One row per pair, the earlier level minus the later one, in the order of the study."""
    options = _options(selected, asked, asked.factor)
    table = pairwise_tests(
        selected.table,
        "value",
        padjust=asked.correction,
        family=asked.family,
        effect_interval=asked.interval,
        **options,
    )
    size = "dz" if "within" in options else "hedges"
    family = asked.family or len(table)
    order = selected.levels.get(asked.factor, ())
    rows = [_pair(row, size, asked, family) for row in pairs_in_order(table, order, (size,))]
    return answer_of(
        selected,
        rows,
        _pairs_method(table, size, asked, family),
        _pair_kinds(size, asked),
        headline=_differing(rows, selected.alpha, f"{CORRECTED[asked.correction]}, family of {family}"),
        table=used(selected, table),
        notes=made_of(table),
    )


def equivalence_answer(selected: Selected, asked: Equivalence) -> Answer:
    """One row per pair, the earlier level minus the later one, in the order of the study."""
    options = _options(selected, asked, asked.factor) | {"alpha": selected.alpha}
    if asked.bounds is None:
        table = equivalence_tests(selected.table, "value", bounds_dz=asked.bounds_dz, **options)
        turned = table
    else:
        low, high = asked.bounds
        table = equivalence_tests(selected.table, "value", bounds=(low, high), **options)
        turned = equivalence_tests(selected.table, "value", bounds=(-high, -low), **options)
    order = selected.levels.get(asked.factor, ())
    rows = [_equivalent(row) for row in pairs_in_order(table, order, (), turned)]
    within = "within" in options
    return answer_of(
        selected,
        rows,
        _equivalence_method(within, asked),
        _equivalence_kinds(selected.alpha),
        headline=_equivalences(rows, selected.alpha),
        table=used(selected, table),
        notes=made_of(table),
    )


def _options(selected: Selected, asked: Asked, factor: str) -> dict[str, Any]:
    """Whether the factor varies within participants, and what else the tests are to know."""
    require_columns(selected.table, ("participant", factor, "value"))
    levels = selected.table.groupby("participant")[factor].nunique()
    kind = "between" if len(levels) and levels.max() < 2 else "within"
    missing = "listwise" if asked.missing == "listwise" else "raise"
    return {kind: factor, "subject": "participant", "missing": missing, "aggregate": "mean"}


def _pair(row: Mapping[str, Any], size: str, asked: Pairs, family: int) -> Row:
    name = "cohens_dz" if size == "dz" else "hedges_g"
    return plain_row(
        {
            **{"factor": row["Contrast"], "a": str(row["A"]), "b": str(row["B"])},
            **{"mean_difference": row["mean_diff"], "ci95_low": row["ci_low"], "ci95_high": row["ci_high"]},
            **{"t": row["T"], "df": row["dof"], "p": row["p_corr"], "correction": asked.correction, "family": family},
            **{"p_uncorrected": row["p_unc"], name: row[size]},
            **{f"{name}_{end}": row[f"{size}_{end}"] for end in ("low", "high")},
            "note": row["note"],
        }
    )


def _pairs_method(table: pd.DataFrame, size: str, asked: Pairs, family: int) -> str:
    effect = share(asked.interval, "intervals from the noncentral t (Steiger & Fouladi 1997)")
    if size == "dz":
        test = f"Paired t tests, two-sided; dz with {effect}"
    else:
        sizes = set(table.attrs["group_sizes"].values())
        kind = "pooled variance" if len(sizes) == 1 else "Welch's where two groups differ in size, else pooled"
        test = f"t tests between groups, two-sided, {kind}; Hedges' g with {effect}"
    return f"{test}; {CORRECTED[asked.correction]} over a family of {family}"


def _pair_kinds(size: str, asked: Pairs) -> dict[str, str]:
    name = "cohens_dz" if size == "dz" else "hedges_g"
    told = "dz: mean difference / SD of differences" if size == "dz" else "Hedges' g"
    interval = share(asked.interval, "interval, noncentral t")
    return {
        "mean_difference": "a minus b",
        "ci95_low": "95% interval of the mean difference, not adjusted",
        "ci95_high": "95% interval of the mean difference, not adjusted",
        "df": "degrees of freedom",
        "p": f"two-sided p, {CORRECTED[asked.correction]}",
        "family": "tests in the family",
        "p_uncorrected": "two-sided p, not adjusted",
        **{name: told, f"{name}_low": interval, f"{name}_high": interval},
    }


def _differing(rows: Sequence[Row], alpha: float, family: str) -> str:
    found = [row for row in rows if isinstance(p := row["p"], float) and p < alpha]
    return _count(f"differ (p < {_plain(alpha)}; {family})", found, rows)


def _equivalent(row: Mapping[str, Any]) -> Row:
    return plain_row(
        {
            **{"factor": row["Contrast"], "a": str(row["A"]), "b": str(row["B"]), "mean_difference": row["mean_diff"]},
            **{"interval_low": row["ci_low"], "interval_high": row["ci_high"]},
            **{name: row[name] for name in ("bound_low", "bound_high")},
            **{"t_low": row["T_low"], "t_high": row["T_high"], "df": row["dof"]},
            **{name: row[name] for name in ("p_low", "p_high", "p", "equivalent", "note")},
        }
    )


def _equivalence_method(within: bool, asked: Equivalence) -> str:
    spread = "SD of the differences" if within else "pooled SD"
    if asked.bounds is None:
        bounds = f"bounds {number(asked.bounds_dz or 0)} times the {spread} as found, to either side of 0"
    else:
        bounds = f"bounds {asked.bounds[0]:g} and {asked.bounds[1]:g} in the outcome's unit"
    kind = "paired" if within else "between groups (Welch's where they differ in size)"
    return f"Two one-sided t tests, {kind} (TOST; Schuirmann 1987; Lakens 2017): {bounds}; no p adjusted for a family"


def _equivalence_kinds(alpha: float) -> dict[str, str]:
    interval = share(1 - 2 * alpha, "interval of the mean difference")
    return {
        "mean_difference": "a minus b",
        "interval_low": interval,
        "interval_high": interval,
        "df": "degrees of freedom",
        "p_low": "one-sided p: the difference is above the lower bound",
        "p_high": "one-sided p: the difference is below the upper bound",
        "p": "the larger of the two one-sided p, not adjusted",
        "equivalent": f"p < {_plain(alpha)}",
    }


def _equivalences(rows: Sequence[Row], alpha: float) -> str:
    return _count(f"are equivalent (TOST, p < {_plain(alpha)})", [row for row in rows if row["equivalent"]], rows)


def _count(what: str, found: Sequence[Row], rows: Sequence[Row]) -> str:
    """How many pairs, and which where they are few."""
    named = ", ".join(f"{row['a']} – {row['b']}" for row in found)
    which = f": {named}" if 0 < len(found) <= TOLD else ""
    return f"{len(found)} of {len(rows)} pairs {what}{which}"


def _plain(value: float) -> str:
    return f"{value:g}".lstrip("0")

"""The answers of analyses of variance (within participants, between them, or both), and of pairs of levels."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pandas as pd

from palpate.analysis.plans.answers import (
    ADJUSTMENTS,
    answer_of,
    plain_row,
    plain_rows,
    require_columns,
    share,
    table_notes,
)
from palpate.analysis.plans.families.mixed_model_answers import gaps_answer
from palpate.analysis.plans.families.rows import refuse_averaging
from palpate.analysis.plans.idle import idle_note
from palpate.analysis.statistics.anova import anova, rm_anova
from palpate.analysis.statistics.apa import P_COLUMNS, apa_f, is_corrected, number
from palpate.analysis.statistics.equivalence import equivalence_tests
from palpate.analysis.statistics.f_and_t import eta_squared_intervals
from palpate.analysis.statistics.mixed_anova import mauchly_tests, mixed_anova
from palpate.analysis.statistics.pairwise import pairs_in_order, pairwise_tests

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Answer, Row, Selected, StatisticSettings
    from palpate.analysis.plans.families.variance import Anova, Equivalence, Pairs


NAMES = {
    "SS": "sum_of_squares",
    "SS_error": "error_sum_of_squares",
    "MS": "mean_square",
    "p_unc": "p_uncorrected",
    "p_GG_corr": "p_greenhouse_geisser",
    "p_HF_corr": "p_huynh_feldt",
    "eps": "epsilon_greenhouse_geisser",
    "eps_HF": "epsilon_huynh_feldt",
}
ETAS = {"np2": "partial_eta_squared", "ng2": "generalized_eta_squared", "eta2": "eta_squared"}
MOST_NAMED = 6
"""The most pairs that a headline names; of more it gives the number."""
HF_UNDEFINED = "Huynh-Feldt is undefined: p is Greenhouse-Geisser's"
TYPES = {"II": "each effect adjusted for all that do not contain it", "III": "unweighted means, sum-to-zero contrasts"}


def anova_answer(selected: Selected, settings: Anova) -> Answer:
    """Return one row per effect, with the tests of sphericity in `more`."""
    require_columns(selected.table, ("participant", *settings.within, *settings.between, "value"))
    if not settings.between:
        table = rm_anova(selected.table, "value", list(settings.within), **_options(settings))
    elif not settings.within and len(settings.between) == 1:
        table = anova(selected.table, "value", settings.between[0], **_options(settings))
    else:
        table = mixed_anova(
            selected.table,
            "value",
            within=settings.within or None,
            between=settings.between,
            sum_of_squares=settings.sum_of_squares,
            **_options(settings),
        )
    records = table.to_dict("records")
    rows, sentences = [], []
    for record in records:
        correction: Any = correction_of(record, settings)
        # The interval of an effect has the degrees of freedom that its p has.
        limits = eta_squared_intervals(pd.DataFrame([record]), confidence=settings.interval, correction=correction)
        rows.append(_row(record, limits.to_dict("records")[0], settings))
        sentences.append(f"{record['Source']}: {apa_f(record, settings.eta, correction)}")
    if settings.within:
        # Mauchly's tests stand beside the answer; they decide nothing.
        between = settings.between or None
        tests = mauchly_tests(selected.table, "value", within=settings.within, between=between, **_options(settings))
        sphericity = plain_rows(tests.rename(columns={"Source": "effect", "d": "contrasts", "ddof": "df"}))
    else:
        sphericity = ()
    sizes = table.attrs.get("group_sizes", {}) if settings.between else {}
    groups = "; ".join(f"{name}: {size}" for name, size in sizes.items())
    return answer_of(
        selected,
        rows,
        _method(settings),
        _kinds(rows, settings),
        table=used(selected, table),
        headline="; ".join(sentences),
        notes=[*reversed(table_notes(table)), f"Participants by group: {groups}." if groups else ""],
        more={"sphericity": sphericity} if sphericity else {},
    )


def _method(settings: Anova) -> str:
    """Return design, sums of squares, correction for sphericity and intervals of eta squared as text."""
    kind = f", type {settings.sum_of_squares} sums of squares ({TYPES[settings.sum_of_squares]})"
    if not settings.between:
        design = f"Repeated-measures analysis of variance: {' x '.join(settings.within)} within participants"
    elif not settings.within:
        design = f"Analysis of variance: {' x '.join(settings.between)} between participants"
        design += kind if len(settings.between) > 1 else ""
    else:
        design = (
            f"Mixed analysis of variance: {' x '.join(settings.within)} within, {' x '.join(settings.between)} between"
        )
        design += f" participants{kind}"
    corrected = {
        "GG": "; Greenhouse-Geisser's correction wherever an effect has more than one contrast within participants",
        "HF": "; Huynh-Feldt's correction (Lecoutre's for groups) wherever an effect has more than one contrast within",
        "none": "; no correction for sphericity",
    }
    end = f"; {100 * settings.interval:g}% intervals of eta squared from the noncentral F (Steiger 2004)"
    return design + (corrected[settings.correction] if settings.within else "") + end


def anova_with_gaps(selected: Selected, settings: Anova) -> Answer:
    """Return the answer of a mixed model where cells are missing, with notes on settings that it ignores."""
    if not settings.within:  # one value from each participant who has one: nothing is left for a random effect
        refuse_averaging(selected, settings.between)
        return anova_answer(selected, settings)
    answer = gaps_answer(selected, settings.within, settings.between)
    where = "where cells are missing and a mixed model answers"
    names = ("sum_of_squares", "correction", "interval", "eta")
    idle = [name for name in names if getattr(settings, name) != type(settings).model_fields[name].default]
    return replace(answer, notes=(*answer.notes, *(idle_note(name, where) for name in idle)))


def _options(settings: Anova) -> dict[str, Any]:
    missing = "listwise" if settings.missing == "listwise" else "raise"
    return {"subject": "participant", "missing": missing, "aggregate": "mean"}


def correction_of(row: Mapping[Hashable, Any], settings: Anova) -> str:
    """Return the correction of an effect's p: "GG", "HF" or "none"; "GG" if Huynh-Feldt is undefined."""
    if not is_corrected(row) or math.isnan(row["F"]):
        return "none"
    return "GG" if settings.correction == "HF" and math.isnan(row["eps_HF"]) else settings.correction


def _row(row: Mapping[Hashable, Any], limits: Mapping[Hashable, Any], settings: Anova) -> Row:
    correction = correction_of(row, settings)
    notes = [str(limits["note"]), HF_UNDEFINED if settings.correction == "HF" and correction == "GG" else ""]
    etas = {
        f"{name}{end}": limits[f"{column}{end}"]
        for column, name in ETAS.items()
        if column in row and (column != "np2" or "eta2" not in row)
        for end in ("", "_low", "_high")
    }
    return plain_row(
        {
            **{"effect": row["Source"], "df1": int(row["ddof1"]), "df2": int(row["ddof2"]), "F": row["F"]},
            **{"p": row[P_COLUMNS[correction]], "correction": correction, **etas},
            **{
                name: row[column] if math.isfinite(row[column]) else math.nan
                for column, name in NAMES.items()
                if column in row
            },
            "note": "; ".join(filter(None, notes)),
        }
    )


def _kinds(rows: Sequence[Row], settings: Anova) -> dict[str, str]:
    named = {"GG": "Greenhouse-Geisser where `correction` says so", "HF": "Huynh-Feldt where `correction` says so"}
    corrected = named.get(settings.correction, "not corrected") if settings.within else "not corrected"
    interval = f"{100 * settings.interval:g}% interval, noncentral F with the degrees of freedom of p"
    generalized = f"{interval}, carried over by the observed ratio of errors"
    meanings = {
        "df1": "degrees of freedom, not corrected",
        "df2": "degrees of freedom, not corrected",
        "p": f"p, {corrected}; not adjusted for a family",
        "partial_eta_squared": "partial eta squared",
        "generalized_eta_squared": "generalized eta squared, every factor manipulated (Olejnik & Algina 2003)",
        "eta_squared": "eta squared: partial, generalized and classical are one number in a one-way design",
        "p_uncorrected": "p, not corrected",
        "p_greenhouse_geisser": "p, Greenhouse-Geisser",
        "p_huynh_feldt": "p, Huynh-Feldt",
        "epsilon_greenhouse_geisser": "Greenhouse-Geisser's epsilon; 1 where there is nothing to correct",
        "epsilon_huynh_feldt": "Huynh-Feldt's epsilon, at most 1",
        **{f"{name}{end}": interval for name in ("partial_eta_squared", "eta_squared") for end in ("_low", "_high")},
        **{f"generalized_eta_squared{end}": generalized for end in ("_low", "_high")},
    }
    return {name: meanings[name] for name in rows[0] if name in meanings}


def used(selected: Selected, result: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that a result uses."""
    return selected.table[~selected.table["participant"].isin(result.attrs.get("dropped", []))]


def pairs_answer(selected: Selected, settings: Pairs) -> Answer:
    """Return one row per pair, the earlier level minus the later one, in the order of the study."""
    options = _pair_options(selected, settings, settings.factor)
    table = pairwise_tests(
        selected.table,
        "value",
        padjust=settings.correction,
        family=settings.family,
        effect_interval=settings.interval,
        **options,
    )
    size = "dz" if "within" in options else "hedges"
    family = settings.family or len(table)
    order = selected.levels.get(settings.factor, ())
    rows = [_pair(row, size, settings, family) for row in pairs_in_order(table, order, (size,))]
    effect = share(settings.interval, "intervals from the noncentral t (Steiger & Fouladi 1997)")
    if size == "dz":
        test = f"Paired t tests, two-sided; dz with {effect}"
    else:
        sizes = set(table.attrs["group_sizes"].values())
        kind = "pooled variance" if len(sizes) == 1 else "Welch's where two groups differ in size, else pooled"
        test = f"t tests between groups, two-sided, {kind}; Hedges' g with {effect}"
    return answer_of(
        selected,
        rows,
        f"{test}; {ADJUSTMENTS[settings.correction]} over a family of {family}",
        _pair_kinds(size, settings),
        headline=_count(
            f"differ (p < {_plain(selected.alpha)}; {ADJUSTMENTS[settings.correction]}, family of {family})",
            [row for row in rows if isinstance(p := row["p"], float) and p < selected.alpha],
            rows,
        ),
        table=used(selected, table),
        notes=reversed(table_notes(table)),
    )


def equivalence_answer(selected: Selected, settings: Equivalence) -> Answer:
    """Return one row per pair, the earlier level minus the later one, in the order of the study."""
    options = _pair_options(selected, settings, settings.factor) | {"alpha": selected.alpha}
    if settings.bounds is None:
        table = equivalence_tests(selected.table, "value", bounds_dz=settings.bounds_dz, **options)
        turned = table
    else:
        low, high = settings.bounds
        table = equivalence_tests(selected.table, "value", bounds=(low, high), **options)
        turned = equivalence_tests(selected.table, "value", bounds=(-high, -low), **options)
    order = selected.levels.get(settings.factor, ())
    rows = [_equivalent(row) for row in pairs_in_order(table, order, (), turned)]
    within = "within" in options
    if settings.bounds is None:
        spread = "SD of the differences" if within else "pooled SD"
        bounds = f"bounds {number(settings.bounds_dz or 0)} times the {spread} as found, to either side of 0"
    else:
        bounds = f"bounds {settings.bounds[0]:g} and {settings.bounds[1]:g} in the outcome's unit"
    kind = "paired" if within else "between groups (Welch's where they differ in size)"
    interval = share(1 - 2 * selected.alpha, "interval of the mean difference")
    equivalence_kinds = {
        "mean_difference": "a minus b",
        "interval_low": interval,
        "interval_high": interval,
        "df": "degrees of freedom",
        "p_low": "one-sided p: the difference is above the lower bound",
        "p_high": "one-sided p: the difference is below the upper bound",
        "p": "the larger of the two one-sided p, not adjusted",
        "equivalent": f"p < {_plain(selected.alpha)}",
    }
    return answer_of(
        selected,
        rows,
        f"Two one-sided t tests, {kind} (TOST; Schuirmann 1987; Lakens 2017): {bounds}; no p adjusted for a family",
        equivalence_kinds,
        headline=_count(
            f"are equivalent (TOST, p < {_plain(selected.alpha)})", [row for row in rows if row["equivalent"]], rows
        ),
        table=used(selected, table),
        notes=reversed(table_notes(table)),
    )


def _pair_options(selected: Selected, settings: StatisticSettings, factor: str) -> dict[str, Any]:
    """Return whether the factor varies within participants, and the other options of the tests."""
    require_columns(selected.table, ("participant", factor, "value"))
    levels = selected.table.groupby("participant")[factor].nunique()
    kind = "between" if len(levels) and levels.max() < 2 else "within"
    missing = "listwise" if settings.missing == "listwise" else "raise"
    return {kind: factor, "subject": "participant", "missing": missing, "aggregate": "mean"}


def _pair(row: Mapping[str, Any], size: str, settings: Pairs, family: int) -> Row:
    name = "cohens_dz" if size == "dz" else "hedges_g"
    return plain_row(
        {
            **{"factor": row["Contrast"], "a": str(row["A"]), "b": str(row["B"])},
            **{"mean_difference": row["mean_diff"], "ci95_low": row["ci_low"], "ci95_high": row["ci_high"]},
            **{
                "t": row["T"],
                "df": row["dof"],
                "p": row["p_corr"],
                "correction": settings.correction,
                "family": family,
            },
            **{"p_uncorrected": row["p_unc"], name: row[size]},
            **{f"{name}_{end}": row[f"{size}_{end}"] for end in ("low", "high")},
            "note": row["note"],
        }
    )


def _pair_kinds(size: str, settings: Pairs) -> dict[str, str]:
    name = "cohens_dz" if size == "dz" else "hedges_g"
    meaning = "dz: mean difference / SD of differences" if size == "dz" else "Hedges' g"
    interval = share(settings.interval, "interval, noncentral t")
    return {
        "mean_difference": "a minus b",
        "ci95_low": "95% interval of the mean difference, not adjusted",
        "ci95_high": "95% interval of the mean difference, not adjusted",
        "df": "degrees of freedom",
        "p": f"two-sided p, {ADJUSTMENTS[settings.correction]}",
        "family": "tests in the family",
        "p_uncorrected": "two-sided p, not adjusted",
        **{name: meaning, f"{name}_low": interval, f"{name}_high": interval},
    }


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


def _count(what: str, chosen: Sequence[Row], rows: Sequence[Row]) -> str:
    """Return a sentence on how many of the pairs were selected, and which if they are few."""
    named = ", ".join(f"{row['a']} – {row['b']}" for row in chosen)
    which = f": {named}" if 0 < len(chosen) <= MOST_NAMED else ""
    return f"{len(chosen)} of {len(rows)} pairs {what}{which}"


def _plain(value: float) -> str:
    return f"{value:g}".lstrip("0")

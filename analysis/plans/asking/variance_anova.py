"""The answer of an analysis of variance: within participants, between them, or both."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from palpate.analysis.plans.asking.describing_rows import (
    answer_of,
    averaged_note,
    plain_row,
    plain_rows,
    require_columns,
)
from palpate.analysis.statistics.apa import apa_f
from palpate.analysis.statistics.between import anova
from palpate.analysis.statistics.eta_intervals import eta_squared_intervals
from palpate.analysis.statistics.mixed import mixed_anova
from palpate.analysis.statistics.sphericity import mauchly_tests
from palpate.analysis.statistics.within import rm_anova

if TYPE_CHECKING:
    import pandas as pd

    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.asking.variance import Anova

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
P_COLUMNS = {"GG": "p_GG_corr", "HF": "p_HF_corr", "none": "p_unc"}
HF_UNDEFINED = "Huynh-Feldt is undefined: p is Greenhouse-Geisser's"
TYPES = {"II": "each effect adjusted for all that do not contain it", "III": "unweighted means, sum-to-zero contrasts"}


def anova_answer(selected: Selected, asked: Anova) -> Answer:
    """One row per effect; the tests of sphericity beside it."""
    require_columns(selected.table, ("participant", *asked.within, *asked.between, "value"))
    table = _table(selected.table, asked)
    records = table.to_dict("records")
    limits = [_limits(row, asked) for row in records]
    rows = [_row(row, own, asked) for row, own in zip(records, limits, strict=True)]
    return answer_of(
        selected,
        rows,
        _method(asked),
        _kinds(rows, asked),
        table=used(selected, table),
        headline="; ".join(_sentence(row, asked) for row in records),
        notes=[*made_of(table), _groups(table, asked)],
        more=_sphericity(selected.table, asked),
    )


def _options(asked: Anova) -> dict[str, Any]:
    missing = "listwise" if asked.missing == "listwise" else "raise"
    return {"subject": "participant", "missing": missing, "aggregate": "mean"}


def _table(rows: pd.DataFrame, asked: Anova) -> pd.DataFrame:
    if not asked.between:
        return rm_anova(rows, "value", list(asked.within), **_options(asked))
    if not asked.within and len(asked.between) == 1:
        return anova(rows, "value", asked.between[0], **_options(asked))
    return mixed_anova(
        rows,
        "value",
        within=asked.within or None,
        between=asked.between,
        sum_of_squares=asked.sum_of_squares,
        **_options(asked),
    )


def correction_of(row: Mapping[Hashable, Any], asked: Anova) -> str:
    """ "GG", "HF" or "none": what p of an effect is corrected by; Greenhouse-Geisser where Huynh-Feldt has no value."""
    contrasts = row.get("d", row["ddof1"] if "eps" in row else 1)
    if contrasts < 2 or math.isnan(row["F"]):
        return "none"
    return "GG" if asked.correction == "HF" and math.isnan(row["eps_HF"]) else asked.correction


def _limits(row: Mapping[Hashable, Any], asked: Anova) -> Mapping[Hashable, Any]:
    """The intervals of an effect, with the degrees of freedom that its p has."""
    import pandas as pd

    correction: Any = correction_of(row, asked)
    found = eta_squared_intervals(pd.DataFrame([row]), confidence=asked.interval, correction=correction)
    return dict(found.to_dict("records")[0])


def _row(row: Mapping[Hashable, Any], limits: Mapping[Hashable, Any], asked: Anova) -> Row:
    correction = correction_of(row, asked)
    notes = [str(limits["note"]), HF_UNDEFINED if asked.correction == "HF" and correction == "GG" else ""]
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
            **{name: _finite(row[column]) for column, name in NAMES.items() if column in row},
            "note": "; ".join(filter(None, notes)),
        }
    )


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.nan


def _sentence(row: Mapping[Hashable, Any], asked: Anova) -> str:
    correction: Any = correction_of(row, asked)
    return f"{row['Source']}: {apa_f(row, asked.eta, correction)}"


def _method(asked: Anova) -> str:
    kind = f", type {asked.sum_of_squares} sums of squares ({TYPES[asked.sum_of_squares]})"
    if not asked.between:
        design = f"Repeated-measures analysis of variance: {' x '.join(asked.within)} within participants"
    elif not asked.within:
        design = f"Analysis of variance: {' x '.join(asked.between)} between participants"
        design += kind if len(asked.between) > 1 else ""
    else:
        design = f"Mixed analysis of variance: {' x '.join(asked.within)} within, {' x '.join(asked.between)} between"
        design += f" participants{kind}"
    corrected = {
        "GG": "; Greenhouse-Geisser's correction wherever an effect has more than one contrast within participants",
        "HF": "; Huynh-Feldt's correction (Lecoutre's for groups) wherever an effect has more than one contrast within",
        "none": "; no correction for sphericity",
    }
    end = f"; {100 * asked.interval:g}% intervals of eta squared from the noncentral F (Steiger 2004)"
    return design + (corrected[asked.correction] if asked.within else "") + end


def _kinds(rows: Sequence[Row], asked: Anova) -> dict[str, str]:
    named = {"GG": "Greenhouse-Geisser where `correction` says so", "HF": "Huynh-Feldt where `correction` says so"}
    corrected = named.get(asked.correction, "not corrected") if asked.within else "not corrected"
    interval = f"{100 * asked.interval:g}% interval, noncentral F with the degrees of freedom of p"
    generalized = f"{interval}, carried over by the observed ratio of errors"
    told = {
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
    return {name: told[name] for name in rows[0] if name in told}


def used(selected: Selected, result: pd.DataFrame) -> pd.DataFrame:
    """The rows that a result rests on."""
    return selected.table[~selected.table["participant"].isin(result.attrs.get("dropped", []))]


def made_of(result: pd.DataFrame) -> list[str]:
    """Who was left out of a result, and how many ratings were averaged for it."""
    least, most = result.attrs.get("ratings_per_cell", (1, 1))
    dropped = result.attrs.get("dropped", [])
    left_out = f"Left out listwise: {', '.join(map(str, dropped))}." if dropped else ""
    return [left_out, averaged_note(least, most)]


def _groups(table: pd.DataFrame, asked: Anova) -> str:
    sizes = table.attrs.get("group_sizes", {}) if asked.between else {}
    groups = "; ".join(f"{name}: {size}" for name, size in sizes.items())
    return f"Participants by group: {groups}." if groups else ""


def _sphericity(rows: pd.DataFrame, asked: Anova) -> dict[str, tuple[Row, ...]]:
    """Mauchly's tests, where an effect has more than one contrast; they decide nothing."""
    if not asked.within:
        return {}
    between = asked.between or None
    found = mauchly_tests(rows, "value", within=asked.within, between=between, **_options(asked))
    named = {"Source": "effect", "d": "contrasts", "ddof": "df", "p": "p", "p_anderson": "p_anderson"}
    return {"sphericity": tuple(plain_rows(found.rename(columns=named)))} if len(found) else {}

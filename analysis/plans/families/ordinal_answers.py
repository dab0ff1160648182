"""The answers of rank tests, ordinal models and Likert summaries from the selected rows."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable
from typing import TYPE_CHECKING, Any

from palpate.analysis.ordinal.aligned import aligned_ranks
from palpate.analysis.ordinal.friedman import friedman
from palpate.analysis.ordinal.likert import MOST_POINTS, likert
from palpate.analysis.ordinal.nemenyi import nemenyi
from palpate.analysis.ordinal.ordinal_model import OrdinalModel, ordinal_model
from palpate.analysis.ordinal.wilcoxon import wilcoxon_tests
from palpate.analysis.plans.answers import (
    ADJUSTMENTS,
    answer_of,
    plain_row,
    plain_rows,
    require_columns,
    share,
    table_notes,
    with_interval,
)
from palpate.analysis.plans.families.rows import left_out, with_numbers
from palpate.analysis.plans.idle import idle_note
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.statistics.apa import apa_p, number
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.families.ordinal import (
        AlignedRanks,
        Friedman,
        Likert,
        Nemenyi,
        Ordinal,
        Wilcoxon,
    )


LINK_NAMES = {"logit": "proportional odds (logit)", "probit": "probit"}
SOURCE = "McCullagh 1980; Christensen 2018"


def model_answer(selected: Selected, settings: Ordinal) -> Answer:
    """Return one row per threshold and slope, and the participants' SD, with likelihood ratio tests in `more`."""
    require_columns(selected.table, ("participant", *settings.fixed, *settings.numeric, "value"))
    table, notes = selected.table, list[str]()
    if settings.missing == "listwise" and (empty := int(table["value"].isna().sum())):
        table = table[table["value"].notna()]
        notes = [f"Left out: {count(empty, 'row')} without an answer."]
    model = ordinal_model(
        with_numbers(table, settings.numeric),
        "value",
        fixed=settings.fixed,
        numeric=settings.numeric,
        interactions=settings.interactions,
        random=settings.random,
        link=settings.link,
        coding=settings.coding,
        orders={name: selected.levels[name] for name in settings.fixed if name in selected.levels},
        confidence=settings.confidence,
    )
    if settings.random is None and bool(table["participant"].duplicated().any()):
        notes.append("Answers of one participant count as independent; `random: participant` would not.")
    fit = {
        **{"log_likelihood": model.log_likelihood, "aic": model.aic, "n": model.n},
        **{"participants": model.participants, "levels": ", ".join(model.levels)},
    }
    return answer_of(
        selected,
        _model_rows(model),
        _method(settings),
        _model_kinds(settings.confidence),
        table=table,
        headline="; ".join(
            f"{row['Source']}: χ²({row['ddof']}) = {number(float(row['LR']))}, {apa_p(float(row['p_unc']))}"
            for row in model.tests.to_dict("records")
        ),
        notes=notes,
        more={
            "tests": plain_rows(model.tests),
            "proportional": plain_rows(model.proportional),
            "fit": (plain_row(fit),),
        },
    )


def _model_kinds(confidence: float) -> dict[str, str]:
    """Return the meaning of each column of the model's tables."""
    wald = share(confidence, "Wald interval")
    return {
        **{"estimate": "maximum likelihood estimate on the latent scale", "se": "standard error", "z": "Wald z"},
        **{"p": "two-sided p of Wald's z", "ci_low": wald, "ci_high": wald, "ddof": "degrees of freedom"},
        **{"LR": "likelihood ratio", "p_unc": "p of the likelihood ratio, type II"},
        **{"log_likelihood": "log likelihood", "aic": "Akaike's criterion", "n": "answers"},
        "participants": "participants with an intercept of their own",
    }


def _model_rows(model: OrdinalModel) -> list[Row]:
    rows = [row | {"note": ""} for row in model.coefficients.to_dict("records")]
    if model.sd is not None:
        undefined: dict[Hashable, Any] = dict.fromkeys(("z", "p", "ci_low", "ci_high"), math.nan)
        note = model.note or "z and p of a standard deviation are undefined; see its likelihood ratio test"
        rows.append(
            {"kind": "sd", "term": "participant", "estimate": model.sd, "se": model.sd_error, **undefined, "note": note}
        )
    return [plain_row(row) for row in rows]


def _method(settings: Ordinal) -> str:
    intercept = (
        "" if settings.random is None else ", a normal intercept per participant (adaptive Gauss-Hermite, 25 nodes)"
    )
    return (
        f"Cumulative link model, {LINK_NAMES[settings.link]}, maximum likelihood{intercept}; {settings.coding} coding;"
        f" proportional odds tested by likelihood ratio ({SOURCE})"
    )


def likert_answer(selected: Selected, settings: Likert) -> Answer:
    """Return one row per item (and level of `by`), in the order of the questions."""
    columns = () if settings.by is None else (settings.by,)
    require_columns(selected.table, ("attribute", "value", *columns))
    table = selected.table
    if settings.form is not None:
        require_columns(table, ("form",))
        known = sorted(set(table["form"].astype(str)))
        if settings.form not in known:
            raise DataRefused(f"no form {settings.form!r}; {nearest(settings.form, known)}")
        table = table[table["form"].astype(str) == settings.form]
    points: Sequence[float] = settings.points or ()
    if not points:
        if selected.scale is None:
            raise DataRefused("the scale is not known; set `points`, as points: [1, 2, 3, 4, 5, 6, 7]")
        low, high = selected.scale
        if low != int(low) or high != int(high) or not 1 <= high - low < MOST_POINTS:
            raise DataRefused(f"a scale from {low:g} to {high:g} has no countable points; set `points`")
        points = [float(point) for point in range(int(low), int(high) + 1)]
    items = [name for name in selected.outcomes if (table["attribute"] == name).any()]
    rows: list[Row] = []
    words = []
    for name in items or list(dict.fromkeys(table["attribute"])):
        own = table[table["attribute"] == name]
        if own["value"].isna().all() and "text" in own and own["text"].fillna("").ne("").any():
            words.append(name)
            continue
        if settings.by is None:
            rows += plain_rows(likert(own, "value", "attribute", points))
            continue
        by_level = plain_rows(likert(own, "value", settings.by, points))
        rows += [
            {"item": name, settings.by: row["item"], **{key: row[key] for key in row if key != "item"}}
            for row in by_level
        ]
    if not rows:
        raise DataRefused("no item was answered with a number")
    notes = [f"Answered in words, not summarised: {', '.join(words)}."] if words else []
    return answer_of(selected, rows, _LIKERT, _LIKERT_KINDS, table=table, notes=notes)


_LIKERT_KINDS = {
    **{"n": "answers", "missing": "answers not given", "median": "median", "q1": "lower quartile, type 7"},
    **{"q3": "upper quartile, type 7", "mean": "mean of the points", "sd": "SD of the points (n - 1)"},
    **{"agree": "share of answers above the middle", "disagree": "share of answers below the middle"},
}
ZEROS = {
    "pratt": "zero differences ranked, their ranks left out (Pratt 1959)",
    "wilcoxon": "zero differences left out (Wilcoxon 1945)",
}
_LIKERT = (
    "Counts and shares of each point; median and quartiles linear between order statistics (type 7 of Hyndman & Fan"
    " 1996); mean and SD take the points as equally far apart"
)


EXACT = "exact p given the ties"


def friedman_answer(selected: Selected, settings: Friedman) -> Answer:
    """Return one row with Friedman's test and Kendall's W."""
    require_columns(selected.table, ("participant", settings.factor, "value"))
    table = friedman(
        selected.table,
        "value",
        settings.factor,
        "participant",
        exact=settings.exact,
        draws=selected.draws,
        seed=selected.seed,
        confidence=settings.confidence,
        missing=left_out(settings),
        aggregate="mean",
    )
    (row,) = plain_rows(table)
    interval = share(
        settings.confidence, f"bootstrap interval of W (participants, {selected.draws} draws, percentiles)"
    )
    kinds = {
        **{"n": "participants", "k": "conditions", "tied": "participants with ties", "ddof1": "degrees of freedom"},
        **{"chi2": "Friedman's chi-squared, corrected for ties", "p_unc": "p, chi-squared approximation"},
        **{"p_exact": EXACT, "W": "Kendall's W, corrected for ties", "W_low": interval, "W_high": interval},
        **{"F": "Iman & Davenport's F", "F_ddof1": "degrees of freedom", "F_ddof2": "degrees of freedom"},
        "p_F": "p of Iman & Davenport's F",
    }
    method = (
        "Friedman's test of midranks within participants, corrected for ties (Friedman 1937; Conover 1999, 5.8), with"
        " Kendall's W and the F of Iman & Davenport (1980)"
    )
    if row["chi2"] is None:
        headline = f"Friedman's test of {settings.factor} is undefined: {row['note']}"
    else:
        chi2, p = (float(row[name] or 0) for name in ("chi2", "p_unc"))
        w = with_interval("Kendall's W", row["W"], row["W_low"], row["W_high"], settings.confidence)
        headline = f"{settings.factor}: χ²({row['ddof1']}) = {number(chi2)}, {apa_p(p)}, {w}"
    return answer_of(selected, [row], method, kinds, headline=headline, notes=table_notes(table))


def nemenyi_answer(selected: Selected, settings: Nemenyi) -> Answer:
    """Return one row per pair of levels with mean ranks and their difference."""
    require_columns(selected.table, ("participant", settings.factor, "value"))
    table = nemenyi(
        selected.table,
        "value",
        settings.factor,
        "participant",
        alpha=selected.alpha,
        ties=settings.ties,
        missing=left_out(settings),
        aggregate="mean",
    )
    kinds = {
        **{"mean_rank_A": "mean rank of A", "mean_rank_B": "mean rank of B", "diff": "mean rank of A minus B"},
        **{"q": "studentized range", "critical": f"difference of mean ranks that is significant at {selected.alpha:g}"},
        **{"p": "p, studentized range over all pairs", "p_exact": f"{EXACT}, this pair alone"},
        "p_exact_holm": f"{EXACT}, Holm",
    }
    spread = "the spread of the ranks found" if settings.ties else "untied ranks' spread"
    method = (
        f"Nemenyi's test of all pairs of mean ranks, {spread} (Nemenyi 1963; Demsar 2006); exact p of each pair's rank"
        " sums (Eisinga et al. 2017)"
    )
    headline = _count_words(settings.factor, table["p"].tolist(), selected.alpha, "Nemenyi")
    return answer_of(selected, plain_rows(table), method, kinds, headline=headline, notes=table_notes(table))


def wilcoxon_answer(selected: Selected, settings: Wilcoxon) -> Answer:
    """Return one row per pair of levels: signed ranks within participants, rank sums between them."""
    require_columns(selected.table, ("participant", settings.factor, "value"))
    levels = selected.table.groupby("participant", observed=True)[settings.factor].nunique()
    between = bool((levels <= 1).all())
    table = wilcoxon_tests(
        selected.table,
        "value",
        within=None if between else settings.factor,
        between=settings.factor if between else None,
        subject="participant",
        padjust=settings.correction,
        family=settings.family,
        zeros="wilcoxon" if between else settings.zeros,
        confidence=settings.confidence,
        missing=left_out(settings),
        aggregate="mean",
    )
    shift = share(settings.confidence, "interval of the shift, not adjusted")
    kinds = {
        **{"n_A": "participants", "n_B": "participants", "zeros": "differences that are zero"},
        **{
            "W": "sum of ranks of A less its minimum" if between else "sum of positive signed ranks",
            "z": "corrected z",
        },
        **{"rank_biserial": "rank-biserial correlation" + ("" if between else ", matched pairs")},
        **{"shift": "Hodges-Lehmann estimate of A minus B", "ci_low": shift, "ci_high": shift, "p_exact": EXACT},
        **{"p_normal": "p, normal approximation with continuity correction"},
        **{"p_unc": "two-sided p, exact where computed, not adjusted", "family": "tests in the family"},
        "p_corr": f"two-sided p, {ADJUSTMENTS[settings.correction]}",
    }
    name = (
        "Wilcoxon's rank-sum test (Mann-Whitney)"
        if between
        else f"Wilcoxon's signed-rank test, {ZEROS[settings.zeros]}"
    )
    method = f"{name}, exact given the ties where affordable; Hodges-Lehmann shift (Hollander, Wolfe & Chicken 2014)"
    headline = _count_words(settings.factor, table["p_corr"].tolist(), selected.alpha, ADJUSTMENTS[settings.correction])
    notes = [*table_notes(table)]
    if between and settings.zeros != "wilcoxon":
        notes.append(idle_note("zeros", "between participants: rank sums have no differences of zero"))
    return answer_of(selected, plain_rows(table), method, kinds, headline=headline, notes=notes)


def aligned_answer(selected: Selected, settings: AlignedRanks) -> Answer:
    """Return one row per effect of the analysis of variance on aligned ranks."""
    require_columns(selected.table, ("participant", *settings.within, *settings.between, "value"))
    table = aligned_ranks(
        selected.table,
        "value",
        within=list(settings.within) or None,
        between=list(settings.between) or None,
        subject="participant",
        sum_of_squares=settings.sum_of_squares,
        missing=left_out(settings),
        aggregate="mean",
    )
    kinds = {
        **{"ddof1": "degrees of freedom", "ddof2": "degrees of freedom", "F": "F of the aligned ranks"},
        **{"p_unc": "p, not corrected", "p_GG_corr": "p, Greenhouse-Geisser", "p_HF_corr": "p, Huynh-Feldt"},
        **{"eps": "Greenhouse-Geisser epsilon", "eps_HF": "Huynh-Feldt epsilon", "d": "contrasts within participants"},
        **{"np2": "partial eta squared of the ranks", "ng2": "generalized eta squared of the ranks"},
        **{"aligned_sum": "sum of the aligned values over the sum of their sizes; 0 where alignment is right"},
        "other_F": "largest F of another effect in the aligned values; 0 where alignment is right",
    }
    method = (
        "Aligned rank transform (Higgins & Tashtoush 1994; Wobbrock et al. 2011), then analysis of variance, sums of"
        f" squares of type {settings.sum_of_squares}"
    )
    return answer_of(selected, plain_rows(table), method, kinds, notes=table_notes(table))


def _count_words(factor: str, p: Iterable[float], alpha: float, family: str) -> str:
    values = list(p)
    significant = sum(value < alpha for value in values)
    return f"{factor}: {significant} of {len(values)} pairs differ at {alpha:g} ({family})"

"""The answers of linear mixed models from the selected rows."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from palpate.analysis.mixed_models.blups import random_effects
from palpate.analysis.mixed_models.model import mixed_model
from palpate.analysis.mixed_models.profiling import profile_intervals
from palpate.analysis.plans.answers import answer_of, plain_rows, require_columns, share
from palpate.analysis.plans.families.rows import refuse_averaging, with_numbers
from palpate.analysis.statistics.apa import apa_p, number
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import pandas as pd

    from palpate.analysis.mixed_models.model import MixedModel as Fitted
    from palpate.analysis.plans.answers import Answer, Row, Selected
    from palpate.analysis.plans.families.mixed_model import MixedModel

SOURCE = "Bates, Mächler, Bolker & Walker 2015; df by Satterthwaite's method as in lmerTest"
TESTED = {
    "F": "F of type III",
    "ddof1": "numerator degrees of freedom",
    "ddof2": "denominator degrees of freedom, Satterthwaite",
    "p_unc": "p of F, not adjusted",
}
FITTED = {
    "variance": "variance component",
    "sd": "standard deviation of a random effect",
    "icc": "share of the variance that the fixed effects leave",
    "covariance": "covariance of two random effects",
    "correlation": "correlation of two random effects",
    "log_likelihood": "log likelihood, restricted under REML",
    "aic": "Akaike's criterion",
    "bic": "Bayesian information criterion, n = values",
    "marginal_r2": "marginal R2, Nakagawa & Schielzeth 2013, Johnson 2014",
    "conditional_r2": "conditional R2, Nakagawa & Schielzeth 2013, Johnson 2014",
}


def model_answer(selected: Selected, settings: MixedModel) -> Answer:
    """Return one row per coefficient, with F tests, variances, correlations and measures of fit in `more`."""
    effects = tuple(dict.fromkeys((*settings.fixed, *settings.numeric)))
    grouping = [
        *settings.random,
        *(slope for slopes in settings.random.values() for slope in slopes),
        *settings.interactions,
    ]
    parts = [part for name in grouping for part in ([name] if name in selected.table.columns else name.split(":"))]
    table, notes = _table(selected, (*effects, *parts), settings.numeric)
    # The study's order of the levels of each factor of the model, also of those whose slopes vary.
    slopes = {part for terms in settings.random.values() for name in terms for part in name.split(":")}
    factors = {*settings.fixed, *slopes} - set(settings.numeric)
    model = mixed_model(
        table,
        "value",
        effects,
        settings.random,
        numeric=settings.numeric,
        interactions=settings.interactions,
        uncorrelated=settings.uncorrelated,
        coding=settings.coding,
        levels={name: levels for name, levels in selected.levels.items() if name in factors},
        reml=settings.reml,
        confidence=settings.confidence,
    )
    more = _more(model)
    if settings.levels:
        more["random_effects"] = plain_rows(random_effects(model))
    if settings.profile:
        more["profile"] = plain_rows(profile_intervals(model, settings.confidence))
    return answer_of(
        *(selected, plain_rows(model.fixed), _method(model, settings.random), _kinds(settings.confidence)),
        table=table,
        headline=_headline(model),
        notes=[*notes, *model.notes],
        more=more,
    )


def gaps_answer(selected: Selected, within: Sequence[str], between: Sequence[str]) -> Answer:
    """Return one row per effect of the factors and their interactions: F of type III, Satterthwaite df.

    The cells' means have random participants and, for several within factors, a random effect of every participant at
    each level and combination of levels except the highest order: on complete data these are the ANOVA's error terms.
    """
    factors = (*within, *between)
    table, notes = _table(selected, factors, ())
    keys = ["participant", *factors]
    refuse_averaging(selected, factors)
    cells = table.sort_values([*keys, "value"]).groupby(keys, observed=True, sort=True)["value"]
    means = cells.mean().reset_index()
    several = int(cells.size().max())
    if several > 1:
        notes.append(f"Each participant's ratings in a cell (at most {several}) were averaged first.")
    crossed = [":".join(parts) for size in range(2, len(factors) + 1) for parts in combinations(factors, size)]
    orders = [parts for size in range(1, len(within)) for parts in combinations(within, size)]
    random = {"participant": (), **{":".join(("participant", *parts)): () for parts in orders}}
    levels = {name: selected.levels[name] for name in factors if name in selected.levels}
    model = mixed_model(means, "value", factors, random, interactions=crossed, levels=levels, coding="sum")
    notes += model.notes
    kinds = TESTED | _kinds(0.95)
    more = {"coefficients": plain_rows(model.fixed), **_more(model)}
    return answer_of(
        *(selected, more.pop("effects"), _method(model, random), kinds),
        table=means,
        headline=_headline(model),
        notes=notes,
        more=more,
    )


def _table(selected: Selected, columns: Iterable[str], numeric: Sequence[str]) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows with a value; columns in `numeric` become numbers."""
    names = list(dict.fromkeys(("participant", *columns)))
    require_columns(selected.table, (*names, "value"))
    answered = selected.table["value"].notna()
    table = selected.table.loc[answered, [*names, "value"]]
    table = with_numbers(table, numeric)
    empty = int((~answered).sum())
    return table, [f"Left out: {count(empty, 'row')} without a value."] if empty else []


def _more(model: Fitted) -> dict[str, tuple[Row, ...]]:
    tables = {"effects": model.effects, "variances": model.variances, "correlations": model.correlations}
    rows_of = {name: plain_rows(table) for name, table in tables.items() if len(table)}
    return {
        "effects": (),
        **rows_of,
        "groups": tuple({"group": name, "levels": levels} for name, levels in model.groups.items()),
        "fit": (
            {
                "values": model.values,
                "criterion": "REML" if model.reml else "ML",
                "deviance": model.criterion,
                "log_likelihood": model.log_likelihood,
                "parameters": model.parameters,
                "aic": model.aic,
                "bic": model.bic,
                "marginal_r2": model.marginal_r2,
                "conditional_r2": model.conditional_r2,
                "singular": model.singular,
            },
        ),
    }


def _kinds(confidence: float) -> dict[str, str]:
    wald = share(confidence, "Wald interval, Student's t with Satterthwaite df")
    return {
        **{"estimate": "fixed effect", "se": "standard error", "df": "degrees of freedom, Satterthwaite"},
        **{"t": "estimate / se", "p": "two-sided p of t, not adjusted", "ci_low": wald, "ci_high": wald},
        **TESTED,
        **FITTED,
    }


def _method(model: Fitted, random: Iterable[str]) -> str:
    fitted = "restricted maximum likelihood" if model.reml else "maximum likelihood"
    groups = ", ".join(random)
    return f"Linear mixed model, random effects of {groups}; {fitted}; {model.coding} coding ({SOURCE})"


def _headline(model: Fitted) -> str:
    parts = [
        f"{row['Source']}: F({row['ddof1']}, {row['ddof2']:.1f}) = {number(row['F'])}, {apa_p(row['p_unc'])}"
        for row in model.effects.to_dict("records")
    ]
    return "; ".join(parts)

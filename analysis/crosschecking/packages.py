"""Calls of pingouin, statsmodels and SciPy, and the mapping of their tables' columns to Palpate's, both only here.

Every call takes plain tables and suppresses warnings, since the comparison shows their effects. Every reader returns
numbers by (row, column), with an effect's factors joined by ":" and Palpate's names of columns.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from importlib import import_module
from types import MappingProxyType
from typing import Any, ParamSpec, TypeAlias, TypeVar

import pandas as pd

Numbers: TypeAlias = dict[tuple[str, str], float]
P = ParamSpec("P")
T = TypeVar("T")
WITHIN_COLUMNS = {"F": "F", "p_unc": "p_unc", "p_GG_corr": "p_GG_corr", "eps": "eps", "ng2": "ng2"}
ICC_TYPES = ("ICC1", "ICC2", "ICC3", "ICC1k", "ICC2k", "ICC3k")
"""The order of the rows of pingouin.intraclass_corr."""
MOST_EXACT, MOST_TURNED = 50, 10
"""The most values for exact p of ranks, and with ties or zeros by permuting every sign."""
GRADIENT = 1e-8
"""The gradient at which the search of a mixed model ends."""
ICC_INTERVAL_DECIMALS, ALPHA_INTERVAL_DECIMALS, CORRELATION_INTERVAL_DECIMALS = 2, 3, 2
"""The number of decimals to which pingouin rounds these intervals."""


def quietly(call: Callable[P, T]) -> Callable[P, T]:
    """Return the call with warnings suppressed."""

    @wraps(call)
    def silent(*args: P.args, **kwargs: P.kwargs) -> T:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return call(*args, **kwargs)

    return silent


def _module(name: str) -> Any:
    """Import a package's module, and disable the warnings that statsmodels enables at import."""
    module = import_module(name)
    warnings.simplefilter("ignore")
    return module


def read_table(table: pd.DataFrame, rows: Iterable[Any], columns: Mapping[str, str]) -> Numbers:
    """Return the numbers of a table with one row per label in `rows`; `columns` maps our column names to its own."""
    present = {ours: table[theirs].tolist() for ours, theirs in columns.items() if theirs in table}
    return {(str(row), ours): float(own[i]) for i, row in enumerate(rows) for ours, own in present.items()}


@quietly
def pingouin_within(table: pd.DataFrame, dv: str, within: Sequence[str], subject: str) -> pd.DataFrame:
    """Run an ANOVA with one or two repeated factors and Greenhouse-Geisser's correction, with one value per cell."""
    pingouin = _module("pingouin")
    factors = list(within) if len(within) > 1 else within[0]
    result: pd.DataFrame = pingouin.rm_anova(table, dv=dv, within=factors, subject=subject, correction=True)
    return result


def read_pingouin_anova(table: pd.DataFrame) -> Numbers:
    """Return the numbers of pingouin's ANOVA within or between participants, by effect."""
    table = table[table["Source"] != "Residual"]
    columns = {**WITHIN_COLUMNS, "np2": "np2"}
    return read_table(table, table["Source"].str.replace(" * ", ":", regex=False), columns)


@quietly
def statsmodels_within(table: pd.DataFrame, dv: str, within: Sequence[str], subject: str) -> pd.DataFrame:
    """Run AnovaRM with any number of factors, without correction; memory grows with the square of the rows."""
    result: pd.DataFrame = (
        _module("statsmodels.stats.anova").AnovaRM(table, dv, subject, within=list(within)).fit().anova_table
    )
    return result


def read_statsmodels_within(table: pd.DataFrame) -> Numbers:
    """Return F and the uncorrected p of every effect."""
    return read_table(table, table.index, {"F": "F Value", "p_unc": "Pr > F"})


@quietly
def pingouin_between(table: pd.DataFrame, dv: str, between: Sequence[str], sum_of_squares: str = "II") -> pd.DataFrame:
    """Run an ANOVA between groups with one value per participant."""
    pingouin = _module("pingouin")
    factors = list(between) if len(between) > 1 else between[0]
    result: pd.DataFrame = pingouin.anova(table, dv=dv, between=factors, ss_type=len(sum_of_squares))
    return result


@quietly
def pingouin_mixed(table: pd.DataFrame, dv: str, within: str, between: str, subject: str) -> pd.DataFrame:
    """Run a mixed ANOVA with one factor within and one between participants, type II sums of squares."""
    pingouin = _module("pingouin")
    result: pd.DataFrame = pingouin.mixed_anova(
        table, dv=dv, within=within, between=between, subject=subject, correction=True, effsize="ng2"
    )
    return result.replace({"Source": {"Interaction": f"{between}:{within}"}})


@quietly
def statsmodels_t(a: Any, b: Any, paired: bool) -> dict[str, float]:
    """Run the t test of the mean of a minus b: paired, or between groups (Welch's where their sizes differ)."""
    stats = _module("statsmodels.stats.weightstats")
    result = stats.DescrStatsW(a - b).ttest_mean(0) if paired else stats.ttest_ind(a, b, usevar=_variance(a, b))
    return dict(zip(("T", "p_unc", "dof"), map(float, result), strict=True))


def _variance(a: Any, b: Any) -> str:
    return "pooled" if len(a) == len(b) else "unequal"


@quietly
def statsmodels_adjusted(p: Sequence[float], correction: str) -> list[float]:
    """Return p values adjusted for their family: "bonferroni", "holm" or "none"."""
    if correction == "none":
        return list(p)
    return [float(value) for value in _module("statsmodels.stats.multitest").multipletests(p, method=correction)[1]]


@quietly
def statsmodels_equivalence(a: Any, b: Any, low: float, high: float, paired: bool) -> tuple[float, float]:
    """Return p of the two one-sided tests that the mean of a minus b is above `low` and below `high`."""
    stats = _module("statsmodels.stats.weightstats")
    limits = (a, b, low, high)
    result = stats.ttost_paired(*limits) if paired else stats.ttost_ind(*limits, usevar=_variance(a, b))
    return float(result[1][1]), float(result[2][1])


@quietly
def pingouin_friedman(table: pd.DataFrame, dv: str, within: str, subject: str) -> pd.DataFrame:
    """Run Friedman's test, corrected for ties, with Kendall's W."""
    pingouin = _module("pingouin")
    result: pd.DataFrame = pingouin.friedman(table, dv=dv, within=within, subject=subject)
    return result


def read_pingouin_friedman(table: pd.DataFrame) -> dict[str, float]:
    """Return chi-squared, its degrees of freedom and p, and W."""
    row = table.iloc[0]
    return {"chi2": float(row["Q"]), "ddof1": float(row["ddof1"]), "p_unc": float(row["p_unc"]), "W": float(row["W"])}


@quietly
def pingouin_signed_ranks(a: Any, b: Any, zeros: str) -> dict[str, float]:
    """Run Wilcoxon's signed-rank test of a minus b.

    Returns W of the positive ranks, RBC, and p exact and by normal approximation. RBC is left out where zero
    differences are ranked (pingouin never does), the normal p where W is closer to its mean than the continuity
    correction (SciPy overcorrects), the exact p of many values with ties or zeros (SciPy's assumes none; for few values
    all signs are permuted). Without any difference the result is empty.
    """
    pingouin = _module("pingouin")
    sizes = abs(a - b)[a != b]
    if not len(sizes):
        return dict.fromkeys(("W", "RBC", "p_normal", "p_exact"), float("nan"))

    def run(x: Any, y: Any, method: Any = "asymptotic", alternative: str = "two-sided") -> Any:
        rule = {"wilcoxon": "wilcox", "pratt": "pratt"}[zeros]
        return pingouin.wilcoxon(x, y, zero_method=rule, method=method, alternative=alternative).iloc[0]

    w, other = (float(run(x, y, alternative="greater")["W_val"]) for x, y in ((a, b), (b, a)))
    numbers = {"W": w}
    if len(sizes) == len(a) or zeros == "wilcoxon":
        numbers["RBC"] = float(run(a, b)["RBC"])
    if abs(w - other) >= 1:
        numbers["p_normal"] = float(run(a, b)["p_val"])
    if len(set(sizes.tolist())) == len(a) <= MOST_EXACT:
        numbers["p_exact"] = float(run(a, b, "exact")["p_val"])
    elif len(a) <= MOST_TURNED:
        turning = _module("scipy.stats").PermutationMethod(n_resamples=2 ** len(a))
        numbers["p_exact"] = float(run(a, b, turning)["p_val"])
    return numbers


@quietly
def pingouin_rank_sums(a: Any, b: Any) -> dict[str, float]:
    """Run Mann & Whitney's test; return U of a as W, RBC, p by normal approximation, and exact p without ties."""
    pingouin = _module("pingouin")
    normal = pingouin.mwu(a, b, method="asymptotic").iloc[0]
    numbers = {"W": float(normal["U_val"]), "RBC": float(normal["RBC"]), "p_normal": float(normal["p_val"])}
    if len({*a.tolist(), *b.tolist()}) == len(a) + len(b) <= MOST_EXACT:
        numbers["p_exact"] = float(pingouin.mwu(a, b, method="exact").iloc[0]["p_val"])
    return numbers


@quietly
def scipy_studentized_range(q: float, k: int) -> float:
    """Return P(range of k standard normal values > q)."""
    return float(_module("scipy.stats").studentized_range.sf(q, k, float("inf")))


@quietly
def pingouin_icc(table: pd.DataFrame, dv: str, targets: str, raters: str) -> pd.DataFrame:
    """Return the six intraclass correlations, with rounded 95 % intervals."""
    pingouin = _module("pingouin")
    result: pd.DataFrame = pingouin.intraclass_corr(table, targets=targets, raters=raters, ratings=dv)
    return result


def read_pingouin_icc(table: pd.DataFrame) -> Numbers:
    """Return ICC, F, p and the rounded ends of the interval by type (ICC1, ..., ICC3k)."""
    return {
        (kind, name): float(value)
        for kind, row in zip(ICC_TYPES, table.to_dict("records"), strict=True)
        for name, value in zip(
            ("ICC", "F", "p", "ci_low", "ci_high"), (row["ICC"], row["F"], row["pval"], *row["CI95"]), strict=True
        )
    }


@quietly
def pingouin_alpha(wide: pd.DataFrame, confidence: float = 0.95) -> dict[str, float]:
    """Return Cronbach's alpha of the columns and its rounded interval."""
    pingouin = _module("pingouin")
    alpha, (low, high) = pingouin.cronbach_alpha(wide, ci=confidence)
    return {"alpha": float(alpha), "ci_low": float(low), "ci_high": float(high)}


@quietly
def statsmodels_kappa(counts: Any) -> float:
    """Return Fleiss' kappa of a table of counts, one row per unit and one column per category."""
    return float(_module("statsmodels.stats.inter_rater").fleiss_kappa(counts))


def nested(table: pd.DataFrame, groups: Sequence[str]) -> bool:
    """Return whether the levels of every other grouping column are nested in those of the first."""
    first, *others = groups
    return all(bool((table.groupby(name, observed=True)[first].nunique() == 1).all()) for name in others)


@quietly
def statsmodels_mixed_model(
    table: pd.DataFrame,
    fixed: Sequence[str],
    groups: Sequence[str],
    slopes: Sequence[str] = (),
    reml: bool = True,
    start: Mapping[str, Any] = MappingProxyType({}),
) -> Any:
    """Fit a linear mixed model of column `y` on the columns `fixed` (including one of ones) by MixedLM.

    One of `groups` has a random intercept and the correlated random `slopes`; with several, each has an intercept. If
    the others are nested in the first of these, it is MixedLM's group; otherwise they are components of one group,
    whose matrix has a row and a column for every value. BFGS continues to a gradient of GRADIENT, since its default
    stops early, and starts at `start`: each group's covariance matrix over the residual variance (with the default
    start it often fails).
    """
    import numpy as np

    first, *others = groups
    model: dict[str, Any] = {"groups": table[first], "re_formula": " + ".join(("1", *slopes))}
    within = not others or nested(table, groups)
    if others and within:
        model["vc_formula"] = {name: f"0 + C({name})" for name in others}
    elif others:
        parts = {name: f"0 + C({name})" for name in groups}
        model = {"groups": np.ones(len(table)), "re_formula": "0", "vc_formula": parts}
    linear_mixed = _module("statsmodels.regression.mixed_linear_model")
    prepared = linear_mixed.MixedLM.from_formula(f"y ~ 0 + {' + '.join(fixed)}", table, **model)
    options: dict[str, Any] = {"reml": reml, "method": "bfgs", "gtol": GRADIENT}
    if start:
        options["start_params"] = linear_mixed.MixedLMParams.from_components(
            fe_params=np.zeros(len(fixed)),
            cov_re=np.asarray(start[first]) if within else np.zeros((0, 0)),
            vcomp=np.array([np.asarray(start[name])[0, 0] for name in prepared.exog_vc.names]),
        )
    return prepared.fit(**options)


def read_statsmodels_mixed_model(fitted: Any, groups: Sequence[str]) -> Numbers:
    """Return estimates and standard errors by column, log likelihood, and variances by group and "Residual"."""
    numbers = {(str(name), "estimate"): float(value) for name, value in fitted.fe_params.items()}
    errors = fixed_covariance(fitted).diagonal() ** 0.5
    numbers |= {(str(name), "se"): float(value) for name, value in zip(fitted.fe_params.index, errors, strict=True)}
    covariance = fitted.cov_re
    if covariance.size:
        effects = ["(Intercept)", *map(str, covariance.index[1:])]
        numbers |= {(f"{groups[0]} {e}", "variance"): float(covariance.iloc[i, i]) for i, e in enumerate(effects)}
    components = zip(fitted.model.exog_vc.names, fitted.vcomp, strict=True)
    numbers |= {(f"{name} (Intercept)", "variance"): float(value) for name, value in components}
    numbers["Residual", "variance"] = float(fitted.scale)
    numbers["fit", "log_likelihood"] = float(fitted.llf)
    return numbers


def fixed_covariance(fitted: Any) -> Any:
    """Return the covariance of the fixed effects at the fitted variances, as in lme4.

    MixedLM's own is a part of the inverse of the observed information of all parameters, which includes the uncertainty
    of the variances.
    """
    import numpy as np

    whole, count = np.asarray(fitted.cov_params()), len(fitted.fe_params)
    fixed, across, random = whole[:count, :count], whole[:count, count:], whole[count:, count:]
    return fixed - across @ np.linalg.solve(random, across.T)


def wald_f(fitted: Any, columns: Sequence[str]) -> float:
    """Return F of the hypothesis that the fixed effects of these columns are all zero, from their covariance."""
    import numpy as np

    places = [fitted.fe_params.index.get_loc(name) for name in columns]
    own = fitted.fe_params.to_numpy()[places]
    return float(own @ np.linalg.solve(fixed_covariance(fitted)[np.ix_(places, places)], own)) / len(own)

"""Columns under the names that a reader knows them by."""

from __future__ import annotations

from collections.abc import Mapping

HEADINGS: Mapping[str, str] = {
    "a": "A", "b": "B", "n": "n", "t": "t", "T": "t", "F": "F", "z": "z", "W": "W", "r": "r", "p": "p",
    "k": "conditions",
    "df": "df", "dof": "df", "df1": "df₁", "df2": "df₂", "ddof1": "df₁", "ddof2": "df₂", "F_ddof1": "df₁ of F",
    "F_ddof2": "df₂ of F", "other_F": "largest other F", "chi2": "χ²", "r2": "R²", "m2": "m²", "Q": "Q", "H": "H",
    "p_unc": "p, uncorrected", "p_uncorrected": "p, uncorrected", "p_corr": "p, corrected",
    "p_corrected": "p, corrected",
    "p_GG_corr": "p, GG", "p_HF_corr": "p, HF", "p_greenhouse_geisser": "p, GG",
    "p_huynh_feldt": "p, HF", "p_exact": "p, exact", "p_exact_holm": "p, exact, Holm", "p_chi2": "p of χ²",
    "p_F": "p of F", "p_low": "p, lower bound", "p_high": "p, upper bound", "p_deviance": "p of the deviance",
    "p_kind": "kind of p", "p_adjust": "adjusted by", "t_low": "t, lower bound", "t_high": "t, upper bound",
    "ci_low": "CI, low", "ci_high": "CI, high", "ci95_low": "95% CI, low", "ci95_high": "95% CI, high",
    "low": "low", "high": "high", "interval_low": "interval, low", "interval_high": "interval, high",
    "bound_low": "bound, low", "bound_high": "bound, high", "W_low": "W, low", "W_high": "W, high",
    "sd": "SD", "se": "SE", "SS": "sum of squares", "MS": "mean square", "SS_error": "error sum of squares",
    "sum_of_squares": "sum of squares", "error_sum_of_squares": "error sum of squares", "mean_square": "mean square",
    "np2": "η²p", "partial_eta_squared": "η²p", "partial_eta_squared_low": "η²p, low", "np2_low": "η²p, low",
    "partial_eta_squared_high": "η²p, high", "np2_high": "η²p, high", "ng2": "η²G", "ng2_low": "η²G, low",
    "ng2_high": "η²G, high", "generalized_eta_squared": "η²G", "generalized_eta_squared_low": "η²G, low",
    "generalized_eta_squared_high": "η²G, high", "eta2": "η²", "eta_squared": "η²", "eta_squared_low": "η², low",
    "eta_squared_high": "η², high", "eps": "ε, GG", "eps_HF": "ε, HF",
    "epsilon_greenhouse_geisser": "ε, GG", "epsilon_huynh_feldt": "ε, HF",
    "mean_diff": "mean difference", "mean_difference": "mean difference", "dz": "dz", "cohens_dz": "dz",
    "cohens_dz_low": "dz, low", "cohens_dz_high": "dz, high", "hedges": "Hedges' g", "family": "family",
    "family_size": "tests in the family", "ICC": "ICC", "Source": "factor", "tied": "with ties", "alpha": "α",
    "kappa": "κ",
    "kendall_w": "Kendall's W", "mean_rank_r": "mean rank r", "raters_with_ties": "raters with ties",
    "sd_interval": "SD of the interval", "half": "half-width", "ratings_min": "ratings, fewest",
    "ratings_max": "ratings, most", "mean_absolute_error": "mean absolute error", "mae": "mean absolute error",
    "r_others": "r with the others", "kept_chance": "chance of being kept", "share_ticked": "share ticked",
    "word_kept": "word kept", "antonym_kept": "antonym kept", "relevance_word": "relevance of the word",
    "relevance_antonym": "relevance of the antonym", "item_rest": "r, item and rest", "item_total": "r, item and total",
    "average_r": "mean r of items", "standardised": "α, standardised", "jnd": "JND", "p_converges": "rests at",
    "converges_at": "comes to rest at", "reversal_threshold": "threshold, reversals",
    "log_likelihood": "log likelihood",
    "aic": "AIC", "bic": "BIC", "icc": "ICC", "marginal_r2": "R², marginal", "conditional_r2": "R², conditional",
    "q1": "lower quartile", "q3": "upper quartile", "min": "least", "max": "most", "whisker_low": "whisker, low",
    "whisker_high": "whisker, high", "semi_major": "ellipse, long half-axis", "semi_minor": "ellipse, short half-axis",
    "angle_deg": "ellipse, angle (°)", "first_trial": "first trial", "last_trial": "last trial", "stars": "marked",
    "response_time_s": "response time (s)", "words_of_its_own": "words of its own",
}  # fmt: skip
_NUMBERED = {"pc": "component", "dim": "dimension", "direction_": "direction"}


def heading(name: str) -> str:
    """Return a column's name in words: what is not known by another name is written with spaces."""
    if name in HEADINGS:
        return HEADINGS[name]
    for start, word in _NUMBERED.items():
        if name.startswith(start) and name.removeprefix(start).isdigit():
            return f"{word} {name.removeprefix(start)}"
    return " ".join(name.replace("_", " ").split())


def is_p(name: str) -> bool:
    """Return whether a column holds p values, by its name."""
    return name == "p" or name.startswith("p_") or name.endswith("_p")


def counts(name: str) -> bool:
    """Return whether a column's whole numbers are shown as such: degrees of freedom and counts."""
    return name in {"n", "W", "family"} or name.startswith(("df", "dof", "ddof", "n_", "count", "F_ddof"))

"""Statistics as sentences in APA style: exact p, corrected degrees of freedom, effect sizes named by their kind.

A row is anything with `get`, such as a dict or a row of a result table. Source: Publication Manual of the American
Psychological Association, 7th ed., 6.36 and 6.43 to 6.45.
"""

from __future__ import annotations

import math
from typing import Any, Literal, Protocol, TypeAlias

Eta: TypeAlias = Literal["partial", "generalized"]
Correction: TypeAlias = Literal["auto", "GG", "HF", "none"]
ETA_COLUMNS = {"partial": "np2", "generalized": "ng2"}
ETA_NAMES = {"partial": "η²p", "generalized": "η²G"}
ETA_BETWEEN = "η²"  # one factor between groups: partial, generalized and classical eta squared are one number
SPHERICITY_CORRECTIONS = {"GG": ("Greenhouse–Geisser", "eps"), "HF": ("Huynh–Feldt", "eps_HF")}
P_COLUMNS = {"GG": "p_GG_corr", "HF": "p_HF_corr", "none": "p_unc"}
FAMILIES = {"bonf": "Bonferroni", "holm": "Holm"}


class Row(Protocol):
    """One row of a result table."""

    def get(self, key: str, /) -> Any:
        """Return the value of a column; None if the row has no such column, or its value is undefined."""


class NoSuchOption(ValueError):
    """A kind of effect size or correction that does not exist, or that the row does not have."""


def apa_p(p: float) -> str:
    """Return a p value as a phrase: "p = .075", "p < .001", "p > .999"; "p undefined" for NaN."""
    if math.isnan(p):
        return "p undefined"
    text = p_value(p)
    return f"p {text}" if text[0] in "<>" else f"p = {text}"


def p_value(p: float) -> str:
    """Return a p value for a table: ".075", "< .001", "> .999", never 0; "–" for NaN.

    Raises NoSuchOption outside [0, 1].
    """
    if math.isnan(p):
        return "–"
    if not 0 <= p <= 1:
        raise NoSuchOption(f"p = {p!r} is not a probability; expected a number from 0 to 1")
    return _share(p, 3)


def apa_f(row: Row, eta: Eta = "partial", correction: Correction = "auto") -> str:
    """Return an effect as a sentence: "F(1.83, 20.11) = 3.03, p = .075, η²p = .22 (Greenhouse–Geisser, ε = .61)".

    "auto" corrects by Greenhouse-Geisser wherever an effect of `rm_anova` or `mixed_anova` has more than one contrast
    within participants, whatever a test of sphericity would say. For a row of `anova` every kind of eta squared is one
    number, "η²". An undefined F gives its reason.
    Raises NoSuchOption for an unknown eta or correction, or one that the row does not hold.
    """
    if not isinstance(eta, str) or eta not in ETA_COLUMNS:
        raise NoSuchOption(f"eta={eta!r} is unknown: 'partial' or 'generalized'")
    df1, df2, f = (_value(row, name) for name in ("ddof1", "ddof2", "F"))
    if math.isnan(f):
        return f"F({_df(df1)}, {_df(df2)}) is undefined: {_reason(row, 'F')}"
    if not isinstance(correction, str) or correction not in ("auto", "none", *SPHERICITY_CORRECTIONS):
        raise NoSuchOption(f"correction={correction!r} is unknown: 'auto', 'GG', 'HF' or 'none'")
    if correction in SPHERICITY_CORRECTIONS and row.get("eps") is None:
        raise NoSuchOption(f"correction={correction!r} needs repeated measures; this row has no epsilon")
    kind = correction if correction != "auto" else "GG" if is_corrected(row) else "none"
    if kind == "none":
        return f"F({_df(df1)}, {_df(df2)}) {_equals(f)}, {apa_p(_value(row, 'p_unc'))}, {_eta(row, eta)}"
    name, eps_column = SPHERICITY_CORRECTIONS[kind]
    eps = _value(row, eps_column)
    if math.isnan(eps):
        raise NoSuchOption(f"{name} is undefined here: {row.get('note')}; pass correction='GG'")
    statistic = f"F({_df(df1 * eps)}, {_df(df2 * eps)}) {_equals(f)}"
    return f"{statistic}, {apa_p(_value(row, P_COLUMNS[kind]))}, {_eta(row, eta)} ({name}, ε {_is(_share(eps, 2))})"


def is_corrected(row: Row) -> bool:
    """Return whether an effect's p needs a correction: it has more than one contrast within participants.

    There is no preceding test of sphericity, which has little power exactly where it is needed.
    """
    contrasts = row.get("d")  # of the factors within participants alone: what there is to correct
    return row.get("eps") is not None and float(row.get("ddof1") if contrasts is None else contrasts) > 1


def apa_t(row: Row) -> str:
    """Return a pair as a sentence.

    For example "t(11) = −2.30, p = .253 (Bonferroni), dz = −0.66, MD = −7.00, 95% CI [−13.70, −0.30]".
    The p value is the adjusted one where a family was adjusted for. An undefined t gives its reason.
    """
    t, df = _value(row, "T"), _df(_value(row, "dof"))
    if math.isnan(t):
        return f"t({df}) is undefined: {_reason(row, 't')}"
    family = FAMILIES.get(row.get("p_adjust"), "")
    p = apa_p(_value(row, "p_corr" if family else "p_unc")) + (f" ({family})" if family else "")
    name, column = ("dz", "dz") if row.get("dz") is not None else ("g", "hedges")
    size = _equals(_value(row, column))
    mean, low, high = (number(_value(row, column)) for column in ("mean_diff", "ci_low", "ci_high"))
    return f"t({df}) {_equals(t)}, {p}, {name} {size}, MD = {mean}, 95% CI [{low}, {high}]"


def number(value: float, digits: int = 2) -> str:
    """Return a number with a true minus sign, in powers of ten if two decimals would be too long or show nothing."""
    if value == 0 or 0.5 * 10**-digits <= abs(value) < 1e6:
        return f"{value:.{digits}f}".replace("-", "−")
    if not math.isfinite(value):
        return "beyond double precision"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa} × 10^{int(exponent)}".replace("-", "−")


def _value(row: Row, column: str) -> float:
    value = row.get(column)
    return math.nan if value is None else float(value)


def _equals(value: float) -> str:
    return f"= {number(value)}"


def _df(value: float) -> str:
    return f"{value:.0f}" if value == int(value) else f"{value:.2f}"


def _share(value: float, digits: int) -> str:
    """Return a number from 0 to 1 without the leading zero; never rounded to 0 or, from below, to 1."""
    least = 10**-digits
    if value < least and (digits == 3 or 0 < value < least / 2):
        return "< " + f"{least:.{digits}f}"[1:]
    if value > 1 - least and (digits == 3 or 1 - least / 2 < value < 1):
        return "> " + f"{1 - least:.{digits}f}"[1:]
    text = f"{value:.{digits}f}"
    return text[1:] if text[0] == "0" else text


def _is(text: str) -> str:
    return text if text[0] in "<>" else f"= {text}"


def _eta(row: Row, eta: Eta) -> str:
    between = row.get("eta2")
    value = row.get(ETA_COLUMNS[eta]) if between is None else between
    if value is None:
        raise NoSuchOption(f"the row has no {eta} eta squared (column {ETA_COLUMNS[eta]!r})")
    name = ETA_NAMES[eta] if between is None else ETA_BETWEEN
    return f"{name} {_is(_share(float(value), 2))}"


def _reason(row: Row, statistic: str) -> str:
    note = str(row.get("note") or "no reason recorded")
    return note.removeprefix(f"{statistic} is undefined: ")

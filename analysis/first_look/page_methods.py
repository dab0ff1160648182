"""The methods of a report in words: what was computed, by which formula, and what was not done."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.analysis.first_look.analysed import Analysed
from palpate.analysis.first_look.page_data import averaged
from palpate.analysis.first_look.page_tests import GROUPS_APART, groups_met
from palpate.protocols.wording import phrase


def methods(found: Analysed) -> Iterator[str]:
    """The paragraphs that the tests of this data set need, and no other."""
    kinds = {question.kind for question in found.statistics.questions}
    yield _means(found)
    if kinds & {"crossed", "pooled"}:
        yield from _REPEATED_MEASURES
    if found.ratings.between and (shared := _shared_kinds(found)):
        yield f"{GROUPS_APART} These are {shared}: there everyone is one sample, whatever the group."
    if "between" in kinds:
        yield f"{_BETWEEN} {groups_met(found)}".rstrip()
    if "pairs" in kinds:
        yield from _PAIRS
    yield _families(found)


def _means(found: Analysed) -> str:
    factors = found.ratings.within
    within = f" {'The factor' if len(factors) == 1 else 'Factors'} within participants: {phrase(factors)}."
    return (
        "Means and standard deviations are taken over participants: each participant's ratings of a level are "
        "averaged first, so that everybody counts once, and the standard deviation (n − 1) is that of these means."
        f"{within if factors else ''} Means and standard deviations are computed in exact arithmetic and rounded once."
    )


def _shared_kinds(found: Analysed) -> str:
    """The tests of everyone together, in words."""
    shared = [question for question in found.statistics.questions if question.group is None]
    effects = [" × ".join(each.factors) for each in shared if each.kind in ("crossed", "pooled")]
    pairs = [f"the pairs of {each.factors[0]}" for each in shared if each.kind == "pairs"]
    return phrase([*(f"the analysis of {name}" for name in effects), *pairs])


_REPEATED_MEASURES = (
    "Factors within participants are tested by the univariate repeated-measures analysis of variance: F is the mean "
    "square of the effect over the mean square of its interaction with participants. Wherever an effect has more than "
    "one degree of freedom, p and both degrees of freedom are corrected by the epsilon of Greenhouse and Geisser "
    "(1959), always and without a test of sphericity first; the uncorrected p and that by the epsilon of Huynh and "
    "Feldt (1976) stand beside it. With fewer than d + 1 participants for an effect of d degrees of freedom the "
    "latter is undefined and left out.",
    "Two effect sizes are given, and they are not the same: partial η² is the sum of squares of the effect over that "
    "sum plus its error; generalized η² (Olejnik & Algina, 2003) divides by the sum of squares of the effect, of "
    "participants and of every error term, and so can be compared between designs.",
)
_BETWEEN = (
    "Groups of participants are compared by a one-way analysis of variance of participants' means, one value for "
    "each participant; η² is the sum of squares between groups over the total."
)
_PAIRS = (
    "Pairs of levels are compared by two-sided t tests of the differences within participants, each with the "
    "standard error of its own differences (n − 1 degrees of freedom). Both adjustments are shown: Bonferroni and "
    "Holm (1979); the family is the pairs of one attribute. Cohen's dz is the mean difference over the standard "
    "deviation of the differences. The confidence intervals are not adjusted.",
)


def _families(found: Analysed) -> str:
    """What was not done: adjusting across attributes, rounding p to zero, imputing."""
    own = len(found.ratings.attributes)
    apart = f"The {own} attributes are tested one by one and p values are not adjusted across them. " if own > 1 else ""
    ratings, values = averaged(found.ratings)
    if ratings:
        made = f"No value is imputed, but {ratings:,} ratings that shared cells are replaced by {values:,} means."
    else:
        made = "No value is replaced or imputed, and a missing cell is never averaged away: its tests are not made."
    return f"{apart}No p value is ever rounded to zero. {made}"

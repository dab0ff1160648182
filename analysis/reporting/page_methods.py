"""The methods of a report in words: what was computed, by which formula, and what was not done."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.reporting.analysed import Analysed
from analysis.reporting.page_text import count, phrase


def methods(found: Analysed) -> Iterator[str]:
    """The paragraphs that the tests of this data set need, and no other."""
    kinds = {question.kind for question in found.statistics.questions}
    yield _means(found)
    if kinds & {"crossed", "pooled"}:
        yield from _REPEATED_MEASURES
    if "between" in kinds:
        yield _BETWEEN
    if "pairs" in kinds:
        yield from _PAIRS
    yield _families(found)


def _means(found: Analysed) -> str:
    within = phrase(found.ratings.within)
    return (
        "Means and standard deviations are taken over participants: each participant's ratings of a level are "
        "averaged first, so that everybody counts once, and the standard deviation (n − 1) is that of these means. "
        f"The factors within participants are {within}. Means and standard deviations are computed in exact "
        "arithmetic and rounded once."
    )


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
    "each participant; η² is the sum of squares between groups over the total. The groups may differ in the stimuli "
    "that they felt as well as in the people."
)
_PAIRS = (
    "Pairs of levels are compared by two-sided t tests of the differences within participants, each with the "
    "standard error of its own differences (n − 1 degrees of freedom). Both adjustments are shown: Bonferroni and "
    "Holm (1979); the family is the pairs of one attribute. Cohen's dz is the mean difference over the standard "
    "deviation of the differences. The confidence intervals are not adjusted.",
)


def _families(found: Analysed) -> str:
    attributes = count(len(found.ratings.attributes), "attribute")
    if len(found.ratings.attributes) == 1:
        return "No p value is ever rounded to zero, and no value is replaced or imputed."
    return (
        f"The {attributes} are tested one by one and p values are not adjusted across them. "
        "No p value is ever rounded to zero, and no value is replaced or imputed."
    )

"""The second opinion: it agrees on ordinary data, it sees a wrong number, and says when no package has it."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.analysis.crosschecking import conditions as comparing
from palpate.analysis.crosschecking import packages
from palpate.analysis.crosschecking.checks import LIMIT, cross_check, difference, line_of, sentence
from palpate.analysis.crosschecking.conditions import Pair
from tests.analysis.crosschecking.answers_for_tests import answered, long, rated


def nested():
    """Participants who differ in each factor by themselves, too."""
    rng = np.random.default_rng(5)
    sizes = (((9, 1, 1), 9), ((9, 4, 1), 5), ((9, 1, 3), 5), ((9, 4, 3), 2))
    return long(sum(rng.normal(0, sd, shape) for shape, sd in sizes))


ORDINARY = {
    "one factor": lambda: answered(rated(), "anova", within=("a",)),
    "two levels": lambda: answered(rated((9, 2)), "anova", within=("a",)),
    "two factors": lambda: answered(rated((8, 3, 4)), "anova", within=("a", "b")),
    "two factors, two people": lambda: answered(rated((2, 3, 4)), "anova", within=("a", "b")),
    "three factors": lambda: answered(rated((8, 3, 2, 2)), "anova", within=("a", "b", "c")),
    "not corrected": lambda: answered(rated(), "anova", within=("a",), correction="none"),
    "averaged over a factor": lambda: answered(rated((8, 3, 4)), "anova", within=("b",)),
    "mixed": lambda: answered(rated(groups=3), "anova", within=("a",), between=("group",)),
    "mixed, unequal groups, type II": lambda: answered(
        rated((11, 4), groups=3), "anova", within=("a",), between=("group",), sum_of_squares="II"
    ),
    "between": lambda: answered(rated((11, 4), groups=3), "anova", between=("group",)),
    "gaps": lambda: answered(rated().drop(index=[1, 5]), "anova", "mixed_model", 2, within=("a",)),
    "gaps in two factors": lambda: answered(
        nested().drop(index=[1, 7]), "anova", "mixed_model", 2, within=("a", "b")
    ),
    "pairs": lambda: answered(rated(), "pairs", factor="a"),
    "pairs between": lambda: answered(rated((11, 1), groups=3), "pairs", factor="group", correction="bonferroni"),
    "pairs, a larger family": lambda: answered(rated(), "pairs", factor="a", family=9),
    "equivalence": lambda: answered(rated(), "equivalence", factor="a", bounds=(-6.0, 5.0)),
    "equivalence in dz": lambda: answered(rated(), "equivalence", factor="a", bounds_dz=0.8),
    "friedman": lambda: answered(rated().round(0), "friedman", factor="a"),
    "nemenyi": lambda: answered(rated().round(0), "nemenyi", factor="a"),
    "nemenyi, ties": lambda: answered(rated().round(-1), "nemenyi", factor="a", ties=True),
    "wilcoxon": lambda: answered(rated(), "wilcoxon", factor="a"),
    "wilcoxon, ties and zeros": lambda: answered(rated((9, 4)).round(-1), "wilcoxon", factor="a"),
    "wilcoxon, zeros ranked": lambda: answered(rated().round(-1), "wilcoxon", factor="a", zeros="pratt"),
    "wilcoxon between": lambda: answered(rated((11, 1), groups=3), "wilcoxon", factor="group", correction="bonferroni"),
    "aligned ranks": lambda: answered(rated((8, 3, 4)).round(0), "aligned_ranks", within=("a", "b")),
    "aligned ranks, one factor": lambda: answered(rated(), "aligned_ranks", within=("a",)),
    "aligned ranks, mixed": lambda: answered(
        rated(groups=3), "aligned_ranks", within=("a",), between=("group",)
    ),
    "aligned ranks, between": lambda: answered(rated((11, 4), groups=3), "aligned_ranks", between=("group",)),
    "aligned ranks, three factors": lambda: answered(rated((8, 3, 2, 2)), "aligned_ranks", within=("a", "b", "c")),
    "kendall_w": lambda: answered(rated(), "kendall_w", targets="stimulus", raters="participant"),
    "icc": lambda: answered(rated(), "icc", targets="stimulus", raters="participant"),
    "cronbach_alpha": lambda: answered(rated(), "cronbach_alpha", items="a", cases=("participant",)),
    "alpha, an item turned": lambda: answered(
        rated(), "cronbach_alpha", items="a", cases=("participant",), reverse=("a1",)
    ),
    "retest": lambda: answered(
        rated((12, 4, 2)).assign(stimulus=lambda t: t["a"]), "retest", targets=("stimulus",), order=("trial",)
    ),
    "mixed model": lambda: answered(rated(), "mixed_model", fixed=("a",)),
    "mixed model, crossed": lambda: answered(
        rated((8, 3, 4)), "mixed_model", fixed=("b",), random={"participant": (), "a": ()}
    ),
    "mixed model, sum coding": lambda: answered(
        rated((8, 3, 4)), "mixed_model", fixed=("a", "b"), interactions=("a:b",), coding="sum"
    ),
    "mixed model, ML and a number": lambda: answered(
        rated().assign(n=lambda t: t["a"].str[1:]), "mixed_model", numeric=("n",), reml=False
    ),
    "mixed model, slopes": lambda: answered(
        long(np.add.outer(np.random.default_rng(2).normal(size=30), np.zeros(6)) * 9
             + np.outer(np.random.default_rng(3).normal(size=30), np.arange(6.0)) * 2
             + np.random.default_rng(4).normal(size=(30, 6))).assign(n=lambda t: t["a"].str[1:]),
        "mixed_model", numeric=("n",), random={"participant": ("n",)},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ORDINARY)
def test_it_agrees_on_ordinary_data(name):
    (result,) = cross_check([ORDINARY[name]()])
    assert not result.reason
    assert result.numbers >= 2
    assert result.difference < (1e-9)


WRONG = {
    "one factor": ("F", "p", "p_greenhouse_geisser", "epsilon_greenhouse_geisser", "generalized_eta_squared"),
    "mixed": ("F", "p", "p_greenhouse_geisser"),
    "between": ("F", "p"),
    "pairs": ("t", "p", "p_uncorrected", "df"),
    "equivalence": ("p_low", "p_high"),
    "friedman": ("chi2", "p_unc", "W"),
    "nemenyi": ("mean_rank_A", "q", "p"),
    "wilcoxon": ("W", "rank_biserial", "p_normal", "p_exact", "p_corr"),
    "wilcoxon between": ("W", "rank_biserial", "p_normal", "p_exact", "p_corr"),
    "aligned ranks, mixed": ("F", "p_unc", "p_GG_corr", "eps"),
    "icc": ("ICC", "F", "p"),
    "cronbach_alpha": ("alpha",),
    "mixed model": ("estimate", "se"),
    "gaps": ("F",),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_number_is_a_disagreement(name):
    """Each number in turn, off by a hundred thousandth."""
    right = ORDINARY[name]()
    for column in WRONG[name]:
        rows = tuple(
            {**row, column: None if row[column] is None else row[column] * (1 + 1e-5)} for row in right.answer.rows
        )
        (result,) = cross_check([replace(right, answer=replace(right.answer, rows=rows))])
        assert result.disagrees, column
        assert 1e-6 < result.difference < 1e-3 or name == "mixed model"


def test_a_variance_that_is_not_the_optimum_is_a_disagreement():
    """MixedLM begins at our estimates, and leaves them where its likelihood is not the largest there."""
    right = ORDINARY["mixed model, crossed"]()
    rows = tuple({**row, "variance": row["variance"] * 1.001} for row in right.answer.more["variances"][:1])
    wrong = replace(right.answer, more={**right.answer.more, "variances": (*rows, *right.answer.more["variances"][1:])})
    (result,) = cross_check([replace(right, answer=wrong)])
    assert result.disagrees
    assert result.where.startswith("variance of ")


def test_a_number_that_only_one_of_them_has_is_a_disagreement():
    right = ORDINARY["one factor"]()
    (result,) = cross_check([replace(right, answer=replace(right.answer, rows=({**right.answer.rows[0], "F": None},)))])
    assert result.disagrees
    assert "F of a: one of the two has no number" in result.text()


def test_rounded_numbers_are_compared_at_their_printed_precision():
    assert difference(Pair("", 0.6251, 0.63, decimals=2)) == 0
    assert difference(Pair("", 0.6249, 0.63, decimals=2)) > LIMIT


def test_what_is_near_zero_is_compared_to_its_own_size_only_where_it_is_a_p():
    assert difference(Pair("", 1e-12, 3e-12, comparing.NEAR_ZERO)) < LIMIT
    assert difference(Pair("", 1e-12, 3e-12)) > 0.5


def test_a_large_table_is_not_checked_and_says_so(monkeypatch):
    monkeypatch.setattr(comparing, "MOST_VALUES", 40)
    (result,) = cross_check([ORDINARY["one factor"]()])
    assert result.checked_with() == "not checked: size (48 values; at most 40)"
    assert result.difference is None and not result.disagrees


def test_a_package_that_fails_costs_no_answer(monkeypatch):
    def broken(*_):
        raise ValueError("no such luck")

    monkeypatch.setattr(packages, "pingouin_within", broken)
    (result,) = cross_check([ORDINARY["one factor"]()])
    assert result.reason == "pingouin failed (ValueError: no such luck)"


def test_what_neither_package_has_says_so_and_other_kinds_have_no_line():
    table = rated()
    krippendorff = answered(table, "krippendorff_alpha", units=("stimulus",), raters="participant", level="interval")
    result = cross_check([krippendorff, answered(table, "means", by=("a",))])
    assert [check.checked_with() for check in result] == ["not checked: neither pingouin nor statsmodels has it"]


def test_the_sentence_counts_what_was_checked_with_what():
    checked = cross_check([ORDINARY["one factor"](), ORDINARY["pairs"]()])
    text = sentence(checked)
    assert text.startswith("2 of 2 answers checked with pingouin ")
    assert " and statsmodels " in text and "the largest relative difference is " in text
    assert sentence(None) == "No second opinion was requested."
    assert line_of([]) == ""

"""Sentences in APA style: never p = 0, never nan, every effect size named."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.analysis import anova, apa_f, apa_p, apa_t, pairwise_tests, rm_anova
from palpate.analysis.statistics.apa import NoSuchOption, number, p_value
from palpate.analysis.statistics.references import edge_table, reference_table


@pytest.mark.parametrize(
    ("p", "phrase", "cell"),
    [
        (0.0, "p < .001", "< .001"),
        (5e-324, "p < .001", "< .001"),
        (0.00099, "p < .001", "< .001"),
        (0.001, "p = .001", ".001"),
        (0.0748, "p = .075", ".075"),
        (0.05, "p = .050", ".050"),
        (0.9994, "p > .999", "> .999"),
        (1.0, "p > .999", "> .999"),
        (math.nan, "p undefined", "–"),
    ],
)
def test_p(p: float, phrase: str, cell: str) -> None:
    assert apa_p(p) == phrase
    assert p_value(p) == cell


@pytest.mark.parametrize("p", [-0.1, 1.1, math.inf])
def test_a_p_that_is_no_probability(p: float) -> None:
    with pytest.raises(NoSuchOption, match="not a probability"):
        apa_p(p)


def test_f_is_always_corrected_where_it_can_be() -> None:
    row = rm_anova(reference_table("csv/md_15.1.csv"), "y", "time", "subject").iloc[0]
    assert apa_f(row) == "F(1.83, 20.11) = 3.03, p = .075, η²p = .22 (Greenhouse–Geisser, ε = .61)"
    assert apa_f(row, "generalized") == "F(1.83, 20.11) = 3.03, p = .075, η²G = .06 (Greenhouse–Geisser, ε = .61)"
    assert apa_f(row, correction="HF") == "F(2.17, 23.92) = 3.03, p = .064, η²p = .22 (Huynh–Feldt, ε = .72)"
    assert apa_f(row, correction="none") == "F(3, 33) = 3.03, p = .043, η²p = .22"
    assert apa_f(row.to_dict()) == apa_f(row)


def test_one_degree_of_freedom_needs_no_correction() -> None:
    row = rm_anova(edge_table("k2"), "y", "cond", "subject").iloc[0]
    assert apa_f(row) == "F(1, 11) = 0.37, p = .555, η²p = .03"
    assert apa_f(row, "generalized") == "F(1, 11) = 0.37, p = .555, η²G = .01"


def test_between_groups() -> None:
    row = anova(reference_table("csv/sk2011.1.csv"), "y", "inference").iloc[0]
    for eta in ("partial", "generalized"):
        assert apa_f(row, eta) == apa_f(row.to_dict(), eta) == "F(3, 316) = 5.97, p < .001, η² = .05"
    with pytest.raises(NoSuchOption, match="needs repeated measures"):
        apa_f(row, correction="GG")


def test_huge_and_tiny() -> None:
    row = rm_anova(edge_table("cond_effect_1e+12_int"), "y", "cond", "subject").iloc[0]
    assert apa_f(row).startswith("F(1.82, 20.04) = 8.42 × 10^22, p < .001, η²p = 1.00")
    none = rm_anova(edge_table("no_effect_exact_cond_means_equal"), "y", "cond", "subject").iloc[0]
    assert apa_f(none).startswith("F(2.78, 30.56) = 0.00, p > .999, η²p = .00")
    assert (number(1e-9), number(-3.456), number(0.0)) == ("1.00 × 10^−9", "−3.46", "0.00")
    assert number(math.inf) == "beyond double precision"


def test_an_undefined_f_gives_its_reason_also_from_saved_rows() -> None:
    row = rm_anova(edge_table("additive_int_zero_resid"), "y", "cond", "subject").iloc[0]
    expected = "F(3, 33) is undefined: the residual has no variation (every participant shows the same effect)"
    assert apa_f(row) == expected
    saved = {key: None if str(value) == "nan" else value for key, value in row.to_dict().items()}
    assert apa_f(saved) == expected


def test_huynh_feldt_that_does_not_exist() -> None:
    row = rm_anova(edge_table("n2_k4"), "y", "cond", "subject").iloc[0]
    assert "Greenhouse–Geisser" in apa_f(row)
    with pytest.raises(NoSuchOption, match="fewer than d"):
        apa_f(row, correction="HF")


def test_unknown_options() -> None:
    row = {"ddof1": 1, "ddof2": 9, "F": 2.0, "p_unc": 0.2}
    with pytest.raises(NoSuchOption, match="'partial' or 'generalized'"):
        apa_f(row, eta="omega")  # type: ignore[arg-type]
    for wrong in (["partial"], {"partial": 1}, np.zeros(2)):
        with pytest.raises(NoSuchOption, match="'partial' or 'generalized'"):
            apa_f(row, eta=wrong)  # type: ignore[arg-type]
        with pytest.raises(NoSuchOption, match="'auto', 'GG', 'HF' or 'none'"):
            apa_f(row, correction=wrong)  # type: ignore[arg-type]
    with pytest.raises(NoSuchOption, match="'auto', 'GG', 'HF' or 'none'"):
        apa_f(row, correction="auto?")  # type: ignore[arg-type]
    with pytest.raises(NoSuchOption, match="no partial eta squared"):
        apa_f(row)


def test_t_sentences() -> None:
    table = reference_table("csv/md_15.1.csv")
    paired = pairwise_tests(table, "y", within="time", subject="subject", padjust="bonf").iloc[1]
    assert apa_t(paired) == "t(11) = −2.30, p = .253 (Bonferroni), dz = −0.66, MD = −7.00, 95% CI [−13.70, −0.30]"
    between = pairwise_tests(reference_table("csv/sk2011.1.csv"), "y", between="inference").iloc[0]
    assert apa_t(between) == "t(158) = −2.74, p = .007, g = −0.43, MD = −13.54, 95% CI [−23.31, −3.78]"
    same = pairwise_tests(edge_table("all_constant_7"), "y", within="cond", subject="subject").iloc[0]
    assert apa_t(same) == "t(11) is undefined: the differences do not vary and their mean is zero"

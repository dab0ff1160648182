"""One-way ANOVA between groups against NIST StRD, exact fractions and, on ordinary data, other software."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import anova
from palpate.analysis.statistics.references import nist_table, nist_values
from tests.analysis.statistics.anova_for_tests import exact_one_way, relative_error

NIST = nist_values()


@pytest.mark.parametrize("name", NIST)
def test_nist_sets_to_the_last_digits(name: str) -> None:
    """Expected: the exact F of the file's numbers as binary doubles (NIST StRD, exact arithmetic); 1e-10 is due."""
    row = anova(nist_table(name), "y", "group").iloc[0]
    expected = NIST[name]["exact_decimal"]
    assert relative_error(row["F"], float(NIST[name]["exact_of_doubles"]["F"])) < 1e-14
    assert (row["ddof1"], row["ddof2"]) == (expected["df1"], expected["df2"])
    if float(expected["p"]) == 0:
        assert row["p_unc"] == math.ulp(0.0)
        assert row["note"] == "p < 5e-324"


@pytest.mark.parametrize("name", ["SiRstv", "SmLs01", "SmLs02", "SmLs03"])
def test_certified_values_where_decimals_are_doubles(name: str) -> None:
    """Expected: NIST's certified values, 15 digits, of the sets whose numbers lose nothing as doubles."""
    row = anova(nist_table(name), "y", "group").iloc[0]
    certified = {key: float(value) for key, value in NIST[name]["certified"].items()}
    assert relative_error(row["F"], certified["F"]) < 2e-12
    assert relative_error(row["SS"], certified["SSB"]) < 2e-12
    assert relative_error(row["SS_error"], certified["SSW"]) < 2e-12
    assert relative_error(row["eta2"], certified["R2"]) < 2e-12
    assert row["np2"] == row["eta2"]


@pytest.mark.parametrize("offset", [0.0, 1e6, 1e12])
def test_unequal_groups_against_exact_fractions(offset: float) -> None:
    rng = np.random.default_rng(11)
    groups = [np.round(rng.normal(50 + i / 10, 3, size), 3) + offset for i, size in enumerate((2, 5, 9, 30, 1))]
    labels = np.repeat(["a", "b", "c", "d", "e"], [len(group) for group in groups])
    row = anova(pd.DataFrame({"g": labels, "y": np.concatenate(groups)}), "y", "g").iloc[0]
    exact = exact_one_way([group.tolist() for group in groups])
    assert exact.f is not None
    assert exact.np2 is not None
    assert relative_error(row["F"], float(exact.f)) < 1e-14
    assert relative_error(row["eta2"], float(exact.np2)) < 1e-14
    assert relative_error(row["SS_error"], float(exact.ss_error)) < 1e-14


def test_an_effect_of_exactly_zero() -> None:
    table = pd.DataFrame({"g": list("aaabbb"), "y": [1.0, 2.0, 3.0, 3.0, 2.0, 1.0]})
    row = anova(table, "y", "g").iloc[0]
    assert (row["F"], row["p_unc"], row["eta2"]) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("values", [[0.1] * 6, [0.1, 0.1, 0.1, 0.3, 0.3, 0.3], [0.3, 0.1 + 0.2, 0.3, 1.0, 1.0, 1.0]])
def test_groups_without_variation_have_no_f(values: list[float]) -> None:
    row = anova(pd.DataFrame({"g": list("aaabbb"), "y": values}), "y", "g").iloc[0]
    assert math.isnan(row["F"])
    assert row["note"].startswith("F is undefined")
    assert math.isnan(row["eta2"]) if len(set(values)) == 1 else row["eta2"] == 1.0

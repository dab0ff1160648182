"""Where common libraries are silently wrong: ours right or refusing, theirs still wrong (docs/reference/statistics.md).

A library that mends its error makes the second half of a test fail: then the table in the docs is to be changed.
"""

from __future__ import annotations

import io
import math
import warnings
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd
import pytest

from benchmarks.statistics.inputs import edge_cells, long_table, wide_input
from palpate.analysis import pairwise_tests, rm_anova
from palpate.analysis.crosschecking import packages
from palpate.analysis.statistics.f_and_t import f_chance, f_noncentrality
from palpate.analysis.statistics.mixed_anova import mixed_anova
from palpate.analysis.statistics.references import reference_table, reference_values
from palpate.analysis.statistics.refusals import IncompleteCells

pytestmark = pytest.mark.filterwarnings("ignore")


def theirs(module: str) -> Any:
    """A library that is compared with."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return import_module(module)


def pingouins(table: pd.DataFrame, within: Any = "A") -> Any:
    return packages.pingouin_within(table, "y", [within] if isinstance(within, str) else within, "subject").iloc[0]


def anova_rms(table: pd.DataFrame, *within: str) -> Any:
    return packages.statsmodels_within(table, "y", within, "subject")


def rated(shape: tuple[int, ...] = (8, 3), seed: int = 7) -> np.ndarray:
    rng = np.random.Generator(np.random.PCG64(seed))
    effect = np.arange(shape[1]).reshape(-1, *(1,) * (len(shape) - 2))
    return np.round(rng.normal(50, 5, (shape[0],) + (1,) * (len(shape) - 1)) + rng.normal(0, 3, shape) + effect, 1)


@pytest.mark.parametrize("constant", [0.1, 0.3])
def test_constant_data_have_no_f(constant: float) -> None:
    table = long_table(np.full((12, 4), constant))
    ours = rm_anova(table, "y", "A", "subject").iloc[0]
    assert math.isnan(ours["F"])
    assert ours["note"].startswith("F is undefined")
    row = pingouins(table)
    assert row["F"] > 10
    assert row["p_unc"] < 1e-4
    assert not math.isnan(anova_rms(table, "A")["F Value"].iloc[0])


def test_constant_data_have_no_f_in_two_factors() -> None:
    table = long_table(np.full((12, 3, 3), 100.0))
    assert rm_anova(table, "y", ["A", "B"], "subject")["F"].isna().all()
    assert anova_rms(table, "A", "B")["F Value"].notna().any()


def test_participants_1e9_apart() -> None:
    cells = edge_cells("base_int")
    plain, moved = (long_table(cells + step * np.arange(12)[:, None]) for step in (0.0, 1e9))
    right = rm_anova(plain, "y", "A", "subject")["F"][0]
    assert right == pytest.approx(4.751578947368421, rel=1e-15)  # exact fractions
    assert rm_anova(moved, "y", "A", "subject")["F"][0] == pytest.approx(right, rel=1e-15)
    assert not abs(pingouins(moved)["F"] / right - 1) < 0.5


def test_more_conditions_than_participants_are_not_called_spherical() -> None:
    given = wide_input()
    exact = given.answer()["A", "p_GG"]
    assert exact is not None
    assert rm_anova(given.table, "y", "A", "subject")["p_GG_corr"][0] == pytest.approx(exact, rel=1e-12)
    result = theirs("pingouin").rm_anova(given.table, dv="y", within="A", subject="subject").iloc[0]
    assert "p_GG_corr" not in result  # no correction was found to be needed
    assert result["p_unc"] < exact * 1e-60


def test_a_participant_with_a_gap_is_not_dropped_without_a_word() -> None:
    table = long_table(rated()).drop(index=[1, 2])
    with pytest.raises(IncompleteCells, match="2 cells missing in all"):
        rm_anova(table, "y", "A", "subject")
    listwise = rm_anova(table, "y", "A", "subject", missing="listwise")
    assert len(listwise.attrs["dropped"]) == 1
    assert pingouins(table)["F"] == pytest.approx(listwise["F"][0])  # one participant fewer, and no word of it


def test_a_gap_is_not_averaged_away() -> None:
    whole = long_table(rated((8, 3, 2)))
    table = whole.drop(index=[1])
    with pytest.raises(IncompleteCells):
        rm_anova(table, "y", ["A", "B"], "subject")
    assert not math.isclose(pingouins(table)["F"], pingouins(whole)["F"], rel_tol=1e-6)


def test_gaps_that_leave_every_condition_with_as_many_are_still_gaps() -> None:
    """AnovaRM counts values per condition only: three participants with one gap each pass, and F is wrong."""
    table = long_table(rated()).drop(index=[0, 4, 8])
    with pytest.raises(IncompleteCells, match="3 cells missing in all"):
        rm_anova(table, "y", "A", "subject")
    right = rm_anova(table, "y", "A", "subject", missing="listwise")
    assert len(right.attrs["dropped"]) == 3
    result = anova_rms(table, "A")
    assert result["Den DF"].iloc[0] != right["ddof2"][0]
    assert abs(result["F Value"].iloc[0] / right["F"][0] - 1) > 0.01


def test_an_undefined_pair_stays_in_its_family() -> None:
    cells = rated((8, 4))
    cells[:, 1] = cells[:, 0]
    table = long_table(cells)
    ours = pairwise_tests(table, "y", within="A", subject="subject", padjust="bonf")
    result = theirs("pingouin").pairwise_tests(table, dv="y", within="A", subject="subject", padjust="bonf")
    assert math.isnan(ours["p_corr"][0])
    place = int(result["p_unc"].idxmin())
    assert ours["p_corr"][place] == pytest.approx(min(1, 6 * ours["p_unc"][place]))
    assert result["p_corr"][place] / result["p_unc"][place] == pytest.approx(5)


def test_friedman_does_not_rank_rounding() -> None:
    """0.1 + 0.2 and 0.3 are one rating in decimals; as doubles they differ, and SciPy ranks the difference."""
    from palpate.analysis.ordinal.friedman import friedman

    tied, rounded = ([[0.3, 0.3, 0.5], [a, 0.3, 0.2], [a, 0.3, 0.7], [0.4, 0.1, 0.6]] for a in (0.3, 0.1 + 0.2))
    expected = theirs("scipy.stats").friedmanchisquare(*np.transpose(tied)).statistic
    assert friedman(long_table(np.array(rounded)), "y", "A", "subject")["chi2"][0] == pytest.approx(expected)
    assert theirs("scipy.stats").friedmanchisquare(*np.transpose(rounded)).statistic != pytest.approx(expected)


def test_a_level_named_none_is_a_level() -> None:
    text = "subject,A,y\n" + "".join(
        f"{i},{level},{i * j % 7}\n" for i in range(6) for j, level in ((2, "None"), (3, "x"))
    )
    lost = pd.read_csv(io.StringIO(text))
    assert lost["A"].isna().sum() == 6
    with pytest.raises(ValueError, match="no label"):
        rm_anova(lost, "y", "A", "subject")
    named = lost.assign(A=["None", "x"] * 6)
    assert rm_anova(named, "y", "A", "subject")["ddof1"][0] == 1


def mixed_model_residual(table: pd.DataFrame) -> float:
    from palpate.analysis.mixed_models.model import mixed_model

    variances = mixed_model(table, "y", fixed=["A"], random={"subject": []}).variances
    return float(variances.set_index("group")["variance"].iloc[-1])


def test_a_mixed_model_with_participants_far_apart() -> None:
    """Complete data: the residual variance by REML is the error mean square of the ANOVA."""
    rng = np.random.Generator(np.random.PCG64(2))
    table = long_table(1e6 * rng.normal(size=(12, 1)) + rng.normal(size=(12, 4)))
    row = rm_anova(table, "y", "A", "subject").iloc[0]
    right = row["SS_error"] / row["ddof2"]
    assert mixed_model_residual(table) == pytest.approx(right, rel=1e-4)
    fitted = theirs("statsmodels.formula.api").mixedlm("y ~ C(A)", table, groups=table["subject"]).fit()
    assert fitted.converged
    assert fitted.scale > 2 * right


def test_type_two_is_not_claimed() -> None:
    """pingouin's mixed ANOVA is type II without saying so; with unequal groups type III is another number."""
    table = reference_table("csv/obk_long.csv").groupby(["subject", "treatment", "hour"], as_index=False)["y"].mean()
    result = theirs("pingouin").mixed_anova(table, dv="y", within="hour", between="treatment", subject="subject")
    theirs_f = result.set_index("Source")["F"]["hour"]
    for kind in ("II", "III"):
        right = reference_values("r_reference")[f"mixed_obk_type{len(kind)}"]["effects"]["hour"]["F"]
        ours = mixed_anova(table, "y", within="hour", between="treatment", subject="subject", sum_of_squares=kind)
        assert ours.set_index("Source")["F"]["hour"] == pytest.approx(right, rel=1e-12)
        assert math.isclose(theirs_f, right, rel_tol=1e-9) is (kind == "II")


def test_the_inverse_of_the_noncentral_f() -> None:
    low, _ = f_noncentrality(64.97, 3, 33, 0.90)
    assert f_chance(64.97, 3, 33, low) == pytest.approx(0.95, abs=1e-12)
    inverse = float(theirs("scipy.special").ncfdtrinc(3, 33, 0.95, 64.97))
    assert abs(inverse / low - 1) > 1e-4


def test_additive_decimals_have_no_f() -> None:
    table = long_table(np.arange(12)[:, None] * 0.1 + np.arange(4) * 0.3)
    assert math.isnan(rm_anova(table, "y", "A", "subject")["F"][0])
    assert pingouins(table)["F"] > 1e20
    assert anova_rms(table, "A")["F Value"].iloc[0] > 1e20


def test_a_constant_difference_has_no_t() -> None:
    table = long_table(np.column_stack([np.arange(6.0), np.arange(6.0) + 1]))
    ours = pairwise_tests(table, "y", within="A", subject="subject").iloc[0]
    assert math.isnan(ours["T"])
    assert ours["note"] == "t is undefined: the differences do not vary"
    result = theirs("pingouin").pairwise_tests(table, dv="y", within="A", subject="subject").iloc[0]
    assert math.isinf(result["T"])
    assert result["p_unc"] == 0

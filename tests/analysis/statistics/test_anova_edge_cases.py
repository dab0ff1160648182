"""Tables that break common implementations: the exact answer (rational arithmetic, p to 60 digits) or a refusal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.analysis import anova, apa_f, pairwise_tests, rm_anova
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.exact import exact_within
from palpate.analysis.statistics.f_and_t import f_tail
from palpate.analysis.statistics.references import edge_cases, edge_table, reference_values
from palpate.analysis.statistics.refusals import TooFew
from tests.analysis.statistics.anova_for_tests import NAMES, exact_one_way, long_table, relative_error

EXACT = reference_values("edge_cases_exact")
REFUSED = {"n1_k4": "one participant", "k1": "one level"}
UNDEFINED = {
    "all_constant_7": "no effect",
    "additive_int_zero_resid": "same effect",
    "subjects_identical": "same effect",
}
ANSWERED = [name for name in edge_cases() if name not in REFUSED and name not in UNDEFINED]


def test_every_stored_case_is_tested() -> None:
    assert set(edge_cases()) == set(EXACT)
    assert len(ANSWERED) == 27


@pytest.mark.parametrize("name", ANSWERED)
def test_exact_answer(name: str) -> None:
    row = rm_anova(edge_table(name), "y", "cond", "subject").iloc[0]
    for key, column in NAMES.items():
        if EXACT[name].get(key) is None:
            continue
        expected = float(EXACT[name][key])
        if expected == 0.0 and key == "p":
            assert row[column] == math.ulp(0.0)
            assert row["note"] == "p < 5e-324"
        elif key == "p_HF" and "Huynh-Feldt is undefined" in row["note"]:
            assert name == "n3_k4"
        else:
            assert relative_error(row[column], expected) < 1e-12, column


@pytest.mark.parametrize("name", UNDEFINED)
def test_undefined_statistics_have_a_reason(name: str) -> None:
    row = rm_anova(edge_table(name), "y", "cond", "subject").iloc[0]
    assert row["note"].startswith("F is undefined: the residual has no variation")
    assert UNDEFINED[name] in row["note"]
    assert all(math.isnan(row[column]) for column in ("F", "p_unc", "p_GG_corr", "p_HF_corr", "eps"))
    for key in ("SS", "SS_error", "pes", "ges"):
        expected = EXACT[name][key]
        result = row[NAMES[key]]
        assert math.isnan(result) if expected is None else result == pytest.approx(float(expected), rel=1e-15)
    assert "undefined" in apa_f(row)
    assert "nan" not in apa_f(row)


@pytest.mark.parametrize("name", REFUSED)
def test_too_small_a_table_is_refused(name: str) -> None:
    with pytest.raises(TooFew, match=REFUSED[name]):
        rm_anova(edge_table(name), "y", "cond", "subject")


@pytest.mark.parametrize("constant", [0.1, 0.3, 100.0, -1e-310, 1e300])
@pytest.mark.parametrize("shape", [(12, 4), (5, 3, 3)])
def test_constant_data_have_no_f(constant: float, shape: tuple[int, ...]) -> None:
    table = rm_anova(long_table(np.full(shape, constant)), "y", ["A", "B"][: len(shape) - 1], "subject")
    assert table["F"].isna().all()
    assert table["SS"].tolist() == [0.0] * len(table)
    assert table["note"].str.contains("undefined").all()


def test_additive_decimals_are_noise_not_an_f() -> None:
    cells = np.arange(12)[:, None] * 0.1 + np.arange(4) * 0.3
    row = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    assert math.isnan(row["F"])
    assert "rounding level" in row["note"]
    assert row["np2"] == 1.0


def few_ulps(most: int) -> Floats:
    """Conditions 1/16 apart around 0.7, residuals of up to `most` units in the last place (2**-53) of the values."""
    ulps = np.random.default_rng(20).integers(-most, most + 1, (12, 4))
    return 0.6 + np.arange(4) * 2.0**-4 + ulps * 2.0**-53


def test_a_residual_of_20_units_in_the_last_place_is_no_rounding() -> None:
    cells = few_ulps(30)
    row = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    f, eps = exact_row(cells)
    assert 10 * 2.0**-53 < math.sqrt(row["SS_error"] / cells.size) < 25 * 2.0**-53
    assert row["note"] in ("", "p < 5e-324", "p < 2.3e-308 has lost digits")
    assert relative_error(row["F"], f) < 1e-14
    assert relative_error(row["eps"], eps) < 1e-13


def test_a_residual_of_2_units_in_the_last_place_is_rounding() -> None:
    cells = few_ulps(3)
    row = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    assert 1.5 * 2.0**-53 < math.sqrt(row["SS_error"] / cells.size) < 2.5 * 2.0**-53
    assert "rounding level" in row["note"]
    assert "rounding level" in anova(long_table(cells), "y", "A").iloc[0]["note"]
    result = [
        *pairwise_tests(long_table(cells), "y", within="A", subject="subject")["note"],
        *pairwise_tests(long_table(cells), "y", between="A")["note"],
    ]
    assert all("rounding level" in note for note in result)


def test_t_tests_and_groups_take_20_units_in_the_last_place_for_variation() -> None:
    cells = few_ulps(30)
    table = long_table(cells)
    exact = exact_one_way([column.tolist() for column in cells.T])
    assert exact.f is not None
    assert relative_error(anova(table, "y", "A").iloc[0]["F"], float(exact.f)) < 1e-14
    pair = table[table["A"].isin(["0", "1"])]
    f, _ = exact_row(cells[:, :2])
    assert relative_error(pairwise_tests(pair, "y", within="A", subject="subject")["T"][0] ** 2, f) < 1e-13
    two = exact_one_way([column.tolist() for column in cells[:, :2].T])
    assert two.f is not None
    assert relative_error(pairwise_tests(pair, "y", between="A")["T"][0] ** 2, float(two.f)) < 1e-13


def test_an_effect_at_rounding_level_beside_a_real_one() -> None:
    cells = 0.1 * np.arange(6)[:, None, None] + 0.3 * np.arange(3)[:, None] + np.zeros(2)
    table = rm_anova(long_table(cells), "y", ["A", "B"], "subject").set_index("Source")
    assert table["F"].isna().all()
    assert table.at["A", "np2"] == 1.0
    assert math.isnan(table.at["B", "np2"])
    assert "there is no effect" in table.at["B", "note"]


def exact_row(cells: Floats) -> tuple[float, float]:
    effect = exact_within(cells.ravel().tolist(), cells.shape, ("A",))[0]
    assert effect.f is not None
    assert effect.eps is not None
    return float(effect.f), float(effect.eps)


def test_more_conditions_than_participants() -> None:
    cells = np.round(np.random.default_rng(90).normal(50, 5, (12, 90)) + np.linspace(0, 9, 90), 1)
    row = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    f, eps = exact_row(cells)
    assert relative_error(row["F"], f) < 1e-13
    assert relative_error(row["eps"], eps) < 1e-13
    assert relative_error(row["p_GG_corr"], f_tail(f, 89 * eps, 979 * eps)) < 1e-12
    assert math.isnan(row["p_HF_corr"])
    assert math.isnan(row["eps_HF"])
    assert row["note"] == "fewer than d + 1 = 90 participants: Huynh-Feldt is undefined, use Greenhouse-Geisser"


@pytest.mark.parametrize("disturbance", ["participants", "conditions", "both", "one cell", "tiny"])
def test_disturbances_of_1e9_keep_every_digit(disturbance: str) -> None:
    cells = np.round(np.random.default_rng(8).normal(50, 5, (12, 4)))
    big = np.zeros_like(cells)
    if disturbance in ("participants", "both"):
        big += 1e9 * np.arange(12)[:, None]
    if disturbance in ("conditions", "both"):
        big += 1e9 * np.arange(4)
    if disturbance == "one cell":
        big[0, 0] = 1e9
    cells = cells * 1e-300 if disturbance == "tiny" else cells + big
    row = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    f, eps = exact_row(cells)
    assert relative_error(row["F"], f) < 1e-14
    assert relative_error(row["eps"], eps) < 1e-13


def test_an_interaction_of_1e12_hides_no_main_effect() -> None:
    rng = np.random.default_rng(5)
    cells = np.round(rng.normal(50, 5, (10, 3, 4)), 2) + 1e10 * np.outer([-1, 0, 1], [-3, -1, 1, 3])
    table = rm_anova(long_table(cells), "y", ["A", "B"], "subject").set_index("Source")
    for effect in exact_within(cells.ravel().tolist(), cells.shape, ("A", "B")):
        assert effect.f is not None
        assert relative_error(table.at[effect.source, "F"], float(effect.f)) < 1e-12


def test_sums_of_squares_beyond_double_precision_leave_f_sound() -> None:
    cells = np.round(np.random.default_rng(4).normal(50, 5, (12, 4)))
    plain = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    for scale in (2.0**1000, 2.0**-1060):
        row = rm_anova(long_table(cells * scale), "y", "A", "subject").iloc[0]
        assert row["F"] == plain["F"]
        assert row["note"] == "sums of squares exceed the range of double precision"


def test_a_p_with_lost_digits_says_so() -> None:
    assert f_tail(1e30, 3, 33) > 0
    cells = np.arange(12)[:, None] % 3 + np.arange(4) * 1e10 + np.eye(12, 4)
    row = rm_anova(long_table(cells), "y", "A", "subject").iloc[0]
    assert 0 < row["p_unc"] < 1e-300
    assert row["note"] in ("p < 2.3e-308 has lost digits", "p < 5e-324")


def disturbed(rng: np.random.Generator) -> Floats:
    """A random table with one to three factors, and offsets of up to 1e10 along random sets of its axes."""
    shape = (int(rng.integers(2, 9)), *rng.integers(2, 5, rng.integers(1, 4)).tolist())
    cells = rng.normal(size=shape)
    for _ in range(rng.integers(0, 3)):
        along = [size if rng.random() < 0.5 else 1 for size in shape]
        cells = cells + 10.0 ** rng.integers(-3, 11) * rng.normal(size=along)
    if rng.random() < 0.3:
        cells[(0,) * cells.ndim] = 10.0 ** rng.integers(0, 12)
    return cells


def test_random_ill_conditioned_tables_against_exact_fractions() -> None:
    rng = np.random.default_rng(2024)
    answered = 0
    for cells in (disturbed(rng) for _ in range(100)):
        names = ["A", "B", "C"][: cells.ndim - 1]
        table = rm_anova(long_table(cells), "y", names, "subject").set_index("Source")
        for effect in exact_within(cells.ravel().tolist(), cells.shape, names):
            row = table.loc[effect.source]
            if "undefined: the residual" in row["note"]:
                continue
            answered += 1
            pairs = {"SS": effect.ss, "F": effect.f, "eps": effect.eps, "np2": effect.np2, "ng2": effect.ng2}
            for column, expected in pairs.items():
                assert expected is not None
                assert relative_error(row[column], float(expected)) < 1e-13, (cells.shape, effect.source, column)
    assert answered > 300

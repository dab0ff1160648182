"""Intraclass correlations against R's psych, the published example, exact fractions, and what has no answer."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from palpate.analysis.reliability.intraclass import icc, iccs
from palpate.analysis.statistics.references import reference_table, reference_values
from palpate.analysis.statistics.refusals import BadOption, DuplicatedCells, IncompleteCells, TooFew
from tests.analysis.reliability.tables import R, long, relative, wide
from tests.examples import examples

NUMBERS = {"ICC": "ICC", "F": "F", "p": "p", "df1": "df1", "df2": "df2", "ci_low": "lower", "ci_high": "upper"}
SHARED = [name for name, entry in reference_values("r_reference").items() if "icc" in entry]
TABLES = hnp.arrays(
    np.float64, st.tuples(st.integers(2, 8), st.integers(2, 6)), elements=st.integers(-50, 50).map(float)
)


def close_to_r(result: pd.DataFrame, rows: list[dict[str, object]]) -> float:
    return max(
        relative(float(ours[column]), float(theirs[key]))
        for (_, ours), theirs in zip(result.iterrows(), rows, strict=True)
        for column, key in NUMBERS.items()
    )


@pytest.mark.parametrize("name", SHARED)
def test_the_shared_sets_give_what_psych_gives(name: str) -> None:
    entry = reference_values("r_reference")[name]
    table = reference_table(f"csv/{entry['csv']}")
    result = icc(table, "y", "subject", entry["within"][0], aggregate="mean")
    assert close_to_r(result, entry["icc"]["rows"]) < 1e-12


@pytest.mark.parametrize("name", R["sets"])
def test_further_sets_give_what_psych_gives_also_where_it_is_negative(name: str) -> None:
    result = icc(long(wide(name), int), "y", "target", "rater")
    assert close_to_r(result, R["sets"][name]["icc"]) < 1e-12
    assert all(("negative" in note) == (value < 0) for note, value in zip(result["note"], result["ICC"], strict=True))


def test_the_published_example_and_both_families_of_names() -> None:
    result = icc(reference_table("csv/shrout_fleiss_1979.csv"), "y", "subject", "rater")
    assert result["ICC"].round(2).tolist() == [0.17, 0.29, 0.71, 0.44, 0.62, 0.91]  # Shrout & Fleiss 1979, table 4
    assert result["type"].tolist() == ["ICC1", "ICC2", "ICC3", "ICC1k", "ICC2k", "ICC3k"]
    assert result["name"].tolist() == ["ICC(1)", "ICC(A,1)", "ICC(C,1)", "ICC(k)", "ICC(A,k)", "ICC(C,k)"]


@pytest.mark.filterwarnings("ignore")  # pingouin's, of what pandas will drop
def test_pingouin_rounds_the_interval_that_we_give_in_full() -> None:
    import pingouin

    table = reference_table("csv/shrout_fleiss_1979.csv")
    theirs = pingouin.intraclass_corr(table, targets="subject", raters="rater", ratings="y")["CI95"].tolist()
    ours = icc(table, "y", "subject", "rater")[["ci_low", "ci_high"]].to_numpy()
    assert np.array_equal(np.round(ours, 2), np.array(theirs))
    assert not np.allclose(ours, np.array(theirs), rtol=1e-3, atol=0)


def exact(values: np.ndarray) -> list[Fraction]:
    """The six values in exact fractions, from the definitions."""
    x = [[Fraction(float(value)) for value in row] for row in values]
    n, k = len(x), len(x[0])
    grand = sum(map(sum, x)) / (n * k)
    rows, columns = [sum(row) / k for row in x], [sum(column) / n for column in zip(*x, strict=True)]
    b = k * sum((row - grand) ** 2 for row in rows) / (n - 1)
    j = n * sum((column - grand) ** 2 for column in columns) / (k - 1)
    within = sum((x[i][c] - rows[i]) ** 2 for i in range(n) for c in range(k))
    e = (within - j * (k - 1)) / ((n - 1) * (k - 1))
    w = within / (n * (k - 1))
    return [
        *((b - w) / (b + (k - 1) * w), (b - e) / (b + (k - 1) * e + k * (j - e) / n), (b - e) / (b + (k - 1) * e)),
        *((b - w) / b, (b - e) / (b + (j - e) / n), (b - e) / b),
    ]


@pytest.mark.parametrize("how", ["offset 1e9", "offset 1e12", "1 + 1e-12 x", "raters 1e9 apart", "times 1e-200"])
def test_extreme_tables_keep_their_digits(how: str) -> None:
    x = wide("many")[:12, :5]
    tables = {
        "offset 1e9": x + 1e9,
        "offset 1e12": x + 1e12,
        "1 + 1e-12 x": 1 + 1e-12 * x,
        "raters 1e9 apart": x + 1e9 * np.arange(5),
        "times 1e-200": x * 1e-200,
    }[how]
    result = [estimate.icc for estimate in iccs(tables)]
    assert max(relative(ours, float(true)) for ours, true in zip(result, exact(tables), strict=True)) < 1e-14


def test_constant_ratings_have_no_icc_and_say_so() -> None:
    for value in (0.0, 0.1, 0.3, 100.0):
        result = icc(long(np.full((5, 4), value)), "y", "target", "rater")
        assert result[["ICC", "F", "p", "ci_low", "ci_high"]].isna().all(axis=None)
        assert result["note"].str.startswith("undefined: the targets do not differ").all()


def test_perfect_agreement_is_one_without_an_interval() -> None:
    result = icc(long(np.arange(5.0)[:, None] * np.ones((1, 3)) * 0.1), "y", "target", "rater")
    assert (result["ICC"] == 1).all()
    assert result[["F", "p", "ci_low", "ci_high"]].isna().all(axis=None)
    assert result["note"].str.contains("agree exactly").all()


def test_raters_shifted_by_a_constant_are_consistent_and_do_not_agree() -> None:
    result = icc(long(np.add.outer([1.0, 2, 4, 8], [0.0, 0.1, 0.3])), "y", "target", "rater").set_index("type")
    assert result.loc["ICC3", "ICC"] == 1
    assert 0.99 < result.loc["ICC2", "ICC"] < 1
    assert np.isfinite(result.loc["ICC1", ["F", "p", "ci_low", "ci_high"]].astype(float)).all()


@pytest.mark.filterwarnings("ignore")  # pingouin's, of what pandas will drop
def test_an_estimated_variance_that_is_not_positive_gives_no_number() -> None:
    import pingouin

    table = long([[1, 2], [2, 1], [1.4, 1.7]])
    result = icc(table, "y", "target", "rater").set_index("type")
    assert np.isnan(result.loc["ICC2k", "ICC"])
    assert "variance of a rating is not above 0" in result.loc["ICC2k", "note"]
    theirs = pingouin.intraclass_corr(table, targets="target", raters="rater", ratings="y").set_index("Type")
    assert theirs.loc["ICC(A,k)", "ICC"] > 1  # a reliability above 1, from dividing by a negative variance


def test_equal_target_means_are_the_least_reliable_there_is() -> None:
    result = icc(long([[1, 2, 3], [2, 3, 1], [3, 1, 2]]), "y", "target", "rater").set_index("type")
    assert result.loc["ICC1", "ICC"] == result.loc["ICC3", "ICC"] == -0.5  # -1 / (k - 1)
    assert (result["F"] == 0).all()
    assert (result["p"] == 1).all()
    assert np.isnan(result.loc["ICC3k", "ICC"])
    assert result["note"].str.contains("the targets' means are equal").all()


def test_what_cannot_be_answered_is_refused_by_name() -> None:
    table = long(wide("many")[:4, :3])
    with pytest.raises(TooFew, match=r"too few raters \(rater\): 1, '0'; at least 2"):
        icc(table[table["rater"] == "0"], "y", "target", "rater")
    with pytest.raises(TooFew, match="too few targets"):
        icc(table[table["target"] == "0"], "y", "target", "rater")
    with pytest.raises(IncompleteCells, match=r"target='3', rater='2'; 1 of 12 cells"):
        icc(table.iloc[:-1], "y", "target", "rater")
    with pytest.raises(DuplicatedCells, match="target='0', rater='0'"):
        icc(pd.concat([table, table.iloc[[0]]]), "y", "target", "rater")
    with pytest.raises(BadOption, match="confidence"):
        icc(table, "y", "target", "rater", confidence=95)
    with pytest.raises(BadOption, match="drop_raters"):
        icc(table, "y", "target", "rater", missing="listwise")  # type: ignore[arg-type]


def test_what_has_gaps_is_left_out_by_name() -> None:
    x = wide("many")[:6, :5].copy()
    x[3, 1] = np.nan
    by_target, by_rater = (icc(long(x), "y", "target", "rater", missing=how) for how in ("drop_targets", "drop_raters"))
    assert by_target.attrs["dropped"] == ["3"]
    assert by_rater.attrs["dropped"] == ["1"]
    assert by_target["ICC"].tolist() == [estimate.icc for estimate in iccs(np.delete(x, 3, axis=0))]
    assert by_rater["ICC"].tolist() == [estimate.icc for estimate in iccs(np.delete(x, 1, axis=1))]


@settings(max_examples=examples(25), deadline=None)
@given(TABLES, st.integers(0, 2**32 - 1))
def test_rows_labels_shift_and_unit_change_nothing(values: np.ndarray, seed: int) -> None:
    plain = icc(long(values), "y", "target", "rater")
    mixed = icc(long(values, int).sample(frac=1, random_state=seed), "y", "target", "rater")
    pd.testing.assert_frame_equal(plain, mixed, check_exact=True)
    moved = icc(long(values * 1024 + 2**40), "y", "target", "rater")
    pd.testing.assert_frame_equal(plain, moved, check_exact=True)
    turned = [estimate.icc for estimate in iccs(values[:, ::-1])]
    np.testing.assert_allclose(turned, plain["ICC"], rtol=1e-12)


@settings(max_examples=examples(40), deadline=None)
@given(TABLES)
def test_every_interval_holds_its_estimate_and_no_number_is_impossible(values: np.ndarray) -> None:
    for estimate in iccs(values):
        assert isinstance(estimate.note, str)
        assert not estimate.icc > 1
        assert not estimate.p <= 0
        assert (
            estimate.note
            or np.isfinite([estimate.icc, estimate.f, estimate.p, estimate.ci_low, estimate.ci_high]).all()
        )
        if np.isfinite(estimate.ci_low):
            assert estimate.ci_low <= estimate.icc <= estimate.ci_high

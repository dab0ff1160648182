"""What must not matter does not: order of rows, type of labels, type of the column, unit, an added constant."""

from __future__ import annotations

import pickle
import tracemalloc

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from palpate.analysis import anova, pairwise_tests, rm_anova
from palpate.analysis.statistics.cells import _natural, ordered
from tests.analysis.statistics.anova_for_tests import long_table, same
from tests.examples import examples

SHAPES = st.one_of(
    st.tuples(st.integers(2, 7), st.integers(2, 12)),
    st.tuples(st.integers(2, 5), st.integers(2, 3), st.integers(2, 4)),
)
RATINGS = hnp.arrays(np.float64, SHAPES, elements=st.integers(-100, 100).map(float))
DECIMALS = hnp.arrays(np.float64, SHAPES, elements=st.floats(-100, 100, width=32).map(lambda x: round(x, 2)))
SEEDS = st.integers(0, 2**32 - 1)


def result_of(table: pd.DataFrame, **options: object) -> pd.DataFrame:
    within = [name for name in table.columns if name in ("A", "B", "C")]
    return rm_anova(table, "y", within, "subject", **options)  # type: ignore[arg-type]


@settings(max_examples=examples(30), deadline=None)
@given(DECIMALS, SEEDS)
def test_the_order_of_rows_changes_no_bit(cells: np.ndarray, seed: int) -> None:
    table = long_table(cells)
    mixed = table.sample(frac=1, random_state=seed)
    assert same(result_of(table), result_of(mixed))
    if cells.ndim == 2:
        pairs = [pairwise_tests(rows, "y", within="A", subject="subject", padjust="holm") for rows in (table, mixed)]
        groups = [anova(rows, "y", "A") for rows in (table, mixed)]
        assert same(*pairs)
        assert same(*groups)


@settings(max_examples=examples(40), deadline=None)
@given(DECIMALS, SEEDS)
def test_the_order_of_averaged_rows_changes_no_bit(cells: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    table = pd.concat([long_table(cells), long_table(np.round(cells + rng.normal(size=cells.shape), 2))])
    mixed = table.sample(frac=1, random_state=seed)
    assert same(result_of(table, aggregate="mean"), result_of(mixed, aggregate="mean"))


@settings(max_examples=examples(25), deadline=None)
@given(DECIMALS)
def test_the_type_of_labels_changes_no_bit(cells: np.ndarray) -> None:
    plain = result_of(long_table(cells))
    for label in (int, float):
        assert same(plain, result_of(long_table(cells, label)))
    named = long_table(cells)
    for column in ("subject", "A"):
        many = pd.CategoricalDtype([str(i) for i in range(30, -1, -1)])
        assert same(plain, result_of(named.astype({column: many})))
        assert same(plain, result_of(named.astype({column: object})))
    assert same(plain, result_of(named.assign(A="level " + named["A"])))


@pytest.mark.parametrize("labels", [["None", "nan"], [True, False], ["2", 10], [None.__class__, int], [0.5, "x"]])
def test_unusual_labels(labels: list[object]) -> None:
    cells = np.round(np.random.default_rng(2).normal(size=(8, 2)), 2)
    table = long_table(cells, int)
    odd = table.assign(A=pd.Series([labels[i] for i in table["A"]], dtype=object))
    result, plain = rm_anova(odd, "y", "A", "subject"), rm_anova(table, "y", "A", "subject")
    assert result["F"].iloc[0] == pytest.approx(plain["F"].iloc[0], rel=1e-13)


def test_equal_labels_of_different_types_are_one_label_in_every_order_of_rows() -> None:
    groups = pd.Series([1, 1.0, np.int64(1), 2.0, 2, 2], dtype=object)
    table = pd.DataFrame({"g": groups, "y": [1.0, 2.0, 4.0, 2.0, 5.0, 9.0]})
    result = [anova(rows, "y", "g") for rows in (table, table.iloc[::-1])]
    assert same(*result)
    assert [list(map(repr, table.attrs["group_sizes"])) for table in result] == [["1.0", "2.0"]] * 2
    assert result[0].attrs["group_sizes"] == {1: 3, 2: 3}


@pytest.mark.parametrize(
    "labels",
    [
        ["P001", "P010", "P002", "P100"],
        ["1e5", "9e4", "2e1", "-1.5", "-1.25", " 7", "+3"],
        ["10", "9", "09", "1" * 400, "2" * 400],
        ["a2", "a10", "b1", "a1"],
        ["v1x2", "v1x1", "v0x9"],
    ],
)
def test_short_cuts_sort_as_the_long_way_does(labels: list[str]) -> None:
    expected = sorted(labels, key=_natural)
    assert ordered(labels) == expected
    values = range(2 * len(labels))
    table = pd.DataFrame({"g": labels * 2, "y": [float(value) ** 2 for value in values]})
    assert list(anova(table, "y", "g").attrs["group_sizes"]) == expected


@settings(max_examples=examples(20), deadline=None)
@given(RATINGS)
def test_the_type_of_the_column_changes_no_bit(cells: np.ndarray) -> None:
    table = long_table(cells)
    plain = result_of(table)
    for kind in ("int64", "int16", "float32", "Int64", "Float64", "object"):
        assert same(plain, result_of(table.astype({"y": kind})))


@settings(max_examples=examples(30), deadline=None)
@given(DECIMALS, st.integers(-900, 900))
def test_a_unit_of_a_power_of_two_changes_no_bit_of_f(cells: np.ndarray, power: int) -> None:
    columns = ["F", "p_unc", "p_GG_corr", "p_HF_corr", "eps", "eps_HF", "np2", "ng2"]
    plain, moved = result_of(long_table(cells)), result_of(long_table(np.ldexp(cells, power)))
    assert same(plain[columns], moved[columns])


@settings(max_examples=examples(40), deadline=None)
@given(RATINGS, st.integers(-(10**12), 10**12))
def test_an_added_constant_changes_no_f_of_integers(cells: np.ndarray, constant: int) -> None:
    plain, moved = result_of(long_table(cells)), result_of(long_table(cells + constant))
    assert same(plain, moved)


@settings(max_examples=examples(40), deadline=None)
@given(RATINGS)
def test_every_result_is_possible(cells: np.ndarray) -> None:
    table = result_of(long_table(cells))
    for _, row in table.iterrows():
        if np.isnan(row["F"]):
            assert "undefined" in row["note"]
            continue
        assert row["F"] >= 0
        assert 0 < row["p_unc"] <= 1
        assert 1 / row["ddof1"] * (1 - 1e-12) <= row["eps"] <= 1
        assert 0 <= row["ng2"] <= row["np2"] * (1 + 1e-12) <= 1 + 1e-12
        assert not row["eps_HF"] < row["eps"] * (1 - 1e-12)
        assert row["p_unc"] <= row["p_GG_corr"] * (1 + 1e-12) or row["F"] < 1.5


def test_a_large_table_gives_what_a_small_path_gives() -> None:
    cells = np.round(np.random.default_rng(1).normal(50, 5, (130, 40)), 1)
    table = long_table(cells)
    assert len(table) > 4096
    plain = rm_anova(table, "y", "A", "subject")
    assert same(plain, rm_anova(table.sample(frac=1, random_state=1), "y", "A", "subject"))
    assert same(plain, rm_anova(table.astype({"A": object, "subject": object}), "y", "A", "subject"))
    assert same(plain, rm_anova(table.astype({"A": "category", "subject": "int32"}), "y", "A", "subject"))


def test_a_result_can_be_changed_without_changing_the_next() -> None:
    table = long_table(np.array([[1.0, 2.0], [3.0, 5.0], [2.0, 2.0]]))
    first, untouched = rm_anova(table, "y", "A", "subject"), rm_anova(table, "y", "A", "subject")
    first.loc[0, "Source"] = "changed"
    first["note"].array[0] = "changed"
    first.columns.name = "changed"
    again = rm_anova(table, "y", "A", "subject")
    assert same(again, untouched)
    assert again["Source"].tolist() == ["A"]
    assert again["note"].tolist() == [""]
    assert again.columns.name is None


def test_a_result_is_an_ordinary_table() -> None:
    """It is put together from blocks; the usual constructor, and what is done with a table, must see no difference."""
    result = rm_anova(long_table(np.random.default_rng(1).normal(size=(6, 3, 2))), "y", ["A", "B"], "subject")
    usual = pd.DataFrame({name: result[name].tolist() for name in result.columns})
    assert same(result, usual)
    assert result.index.equals(usual.index)
    assert same(pickle.loads(pickle.dumps(result)), usual)
    assert same(pd.concat([result, result], ignore_index=True), pd.concat([usual, usual], ignore_index=True))
    for table in (result, usual):
        table["F"] = 1.0
        table.insert(0, "attribute", "soft")
        table.loc[table["Source"] == "A", ["ddof1", "SS"]] = 7
        del table["note"]
    assert same(result.sort_values("p_unc").T, usual.sort_values("p_unc").T)


def test_the_callers_table_is_not_changed() -> None:
    table = long_table(np.arange(12.0).reshape(4, 3) ** 2)
    before = table.copy(deep=True)
    rm_anova(table, "y", "A", "subject")
    pd.testing.assert_frame_equal(table, before)


def peak_per_value(cells: np.ndarray) -> float:
    """Bytes allocated at most, per value of the table."""
    table = long_table(cells, int)
    rm_anova(table.head(2 * cells.shape[1]), "y", "A", "subject")  # what is imported and cached once
    tracemalloc.start()
    try:
        rm_anova(table, "y", "A", "subject")
        return tracemalloc.get_traced_memory()[1] / cells.size
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("shape", [(300, 30), (3000, 30), (30, 600)])
def test_memory_grows_with_the_data_and_no_faster(shape: tuple[int, int]) -> None:
    """No table of participants by participants (3000 x 3000 would be 800 bytes a value), none of conditions squared."""
    cells = np.random.default_rng(1).normal(size=shape)
    assert peak_per_value(cells) < 140

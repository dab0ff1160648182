"""A mistake in a table is named, with what to do; what the caller allows is done and noted."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import anova, pairwise_tests, rm_anova
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    DuplicatedCells,
    IncompleteCells,
    TooFew,
    UnknownColumn,
)
from tests.analysis.statistics.anova_for_tests import same, tell


def test_a_missing_cell_is_named(table: pd.DataFrame) -> None:
    cell = (table["participant"] == "P003") & (table["car"] == "BC3") & (table["variant"] == "1")
    expected = (
        "participant 'P003' has no value at car='BC3', variant='1'; 1 cell missing in all; "
        "pass missing='listwise' to leave such participants out"
    )
    assert tell(table[~cell], IncompleteCells) == expected
    assert tell(table.assign(y=table["y"].mask(cell)), IncompleteCells) == expected


def test_at_most_five_missing_cells_are_named(table: pd.DataFrame) -> None:
    message = tell(table[~((table["car"] == "G90") & (table["participant"] < "P006"))], IncompleteCells)
    assert message.count("has no value") == 5
    assert "and 7 more; 12 cells missing in all" in message


def test_listwise_leaves_out_and_tells(table: pd.DataFrame) -> None:
    gaps = table.drop(index=[1, 20])
    result = rm_anova(gaps, "y", ["car", "variant"], "participant", missing="listwise")
    assert result.attrs == {"participants": 6, "dropped": ["P000", "P003"]}
    whole = table[~table["participant"].isin(["P000", "P003"])]
    assert same(result, rm_anova(whole, "y", ["car", "variant"], "participant"))


def test_listwise_that_leaves_too_few(table: pd.DataFrame) -> None:
    empty = table.assign(y=table["y"].mask(table["variant"] == "1"))
    assert "nothing is left" in tell(empty, IncompleteCells, missing="listwise")
    one = table.assign(y=table["y"].mask((table["variant"] == "1") & (table["participant"] != "P002")))
    assert "one participant, 'P002' (7 left out for missing values)" in tell(one, TooFew, missing="listwise")


def test_a_duplicated_cell_is_named(table: pd.DataFrame) -> None:
    twice = pd.concat([table, table.iloc[[0]]])
    message = tell(twice, DuplicatedCells)
    assert message.startswith("several values in one cell: participant 'P000' at car='BC3', variant='0';")
    assert "aggregate='mean'" in message


def test_a_factor_left_out_is_averaged_over_only_on_request(table: pd.DataFrame) -> None:
    assert "and 19 more" in tell(table, DuplicatedCells, within="car")
    result = rm_anova(table, "y", "car", "participant", aggregate="mean")
    assert result.attrs == {"participants": 8, "dropped": [], "ratings_per_cell": (2, 2)}
    means = table.groupby(["participant", "car"])["y"].mean().reset_index()
    pd.testing.assert_frame_equal(result, rm_anova(means, "y", "car", "participant"), rtol=1e-12)


def test_unequal_averages_are_reported(table: pd.DataFrame) -> None:
    result = rm_anova(table.drop(index=[3]), "y", "car", "participant", aggregate="mean")
    assert result.attrs["ratings_per_cell"] == (1, 2)


def test_a_missing_value_among_repetitions_is_no_average(table: pd.DataFrame) -> None:
    gap = table.assign(y=table["y"].mask(table.index == 3))
    assert "1 cell missing" in tell(gap, IncompleteCells, within="car", aggregate="mean")
    result = rm_anova(gap, "y", "car", "participant", aggregate="mean", missing="listwise")
    assert result.attrs["dropped"] == ["P000"]


@pytest.mark.parametrize("value", [np.inf, -np.inf])
@pytest.mark.parametrize("missing", ["raise", "listwise"])
def test_infinity_is_never_a_rating(table: pd.DataFrame, value: float, missing: str) -> None:
    bad = table.assign(y=table["y"].mask(table.index == 4, value))
    assert f"found {value!r} in row 5" in tell(bad, BadValue, missing=missing)


def test_text_is_not_a_number(table: pd.DataFrame) -> None:
    message = tell(table.assign(y=table["y"].astype(str)), BadValue)
    assert message.count(" in row ") == 5
    assert "and 43 more" in message


def test_effects_of_one_name_are_refused(table: pd.DataFrame) -> None:
    three = pd.DataFrame(np.indices((4, 2, 2, 2)).reshape(4, -1).T, columns=["participant", "a", "b", "a:b"])
    three["y"] = np.arange(32.0) ** 2 % 11
    assert tell(three, UnknownColumn, within=["a", "b", "a:b"]) == (
        "two effects of the factors 'a', 'b', 'a:b' have the same name: 'a:b'; rename a column"
    )
    numbered = three.rename(columns={"a": 1, "b": "1"})
    assert "have the same name: '1'" in tell(numbered, UnknownColumn, within=[1, "1"], aggregate="mean")
    result = rm_anova(three.rename(columns={"a:b": "c"}), "y", ["a", "b", "c"], "participant")
    assert result["Source"].is_unique


def test_columns_are_found_by_their_whole_name(table: pd.DataFrame) -> None:
    levels = table.copy()
    levels.columns = pd.MultiIndex.from_product([["x"], table.columns])
    assert "no column 'y'" in tell(levels, UnknownColumn)
    assert "no column 'x'" in tell(levels, UnknownColumn, dv="x")


@pytest.mark.parametrize(
    "wrong", [{"dv": "rating"}, {"subject": "person"}, {"within": ["car", "colour"]}, {"within": [["car"]]}]
)
def test_an_unknown_column_is_named(table: pd.DataFrame, wrong: dict[str, object]) -> None:
    message = tell(table, UnknownColumn, **wrong)
    assert "no column" in message
    assert "its columns are 'participant', 'car', 'variant', 'y'" in message


def test_a_column_has_one_role(table: pd.DataFrame) -> None:
    assert "'car' is named twice" in tell(table, UnknownColumn, within=["car", "car"])
    assert "'participant' is named twice" in tell(table, UnknownColumn, within=["participant"])
    doubled = pd.concat([table, table[["y"]]], axis=1)
    assert "two columns of the same name" in tell(doubled, UnknownColumn)


def test_options_and_shapes(table: pd.DataFrame) -> None:
    assert "missing='drop'" in tell(table, BadOption, missing="drop")
    assert "aggregate='median'" in tell(table, BadOption, aggregate="median")
    for wrong in (["mean"], {"mean": 1}, table, np.zeros(2)):
        expected = f"<{type(wrong).__name__}> is unknown"
        assert "aggregate=" + expected in tell(table, BadOption, aggregate=wrong)
        assert "missing=" + expected in tell(table, BadOption, missing=wrong)
        with pytest.raises(BadOption, match=f"padjust={expected}"):
            pairwise_tests(table, "y", within="car", subject="participant", padjust=wrong)  # type: ignore[arg-type]
    assert "no factor" in tell(table, BadOption, within=[])
    assert "no rows" in tell(table.iloc[:0], BadValue)
    with pytest.raises(UnknownColumn, match="expected a pandas DataFrame"):
        rm_anova(table.to_dict("list"), "y", "car", "participant")  # type: ignore[arg-type]


def test_a_column_of_numbers_named_as_a_factor_makes_no_giant_table() -> None:
    n = 60_000
    table = pd.DataFrame({"s": np.arange(n) % 5000, "a": np.arange(n), "y": np.zeros(n)})
    with pytest.raises(IncompleteCells, match=r"5,000 's' x 60,000 'a' make 300,000,000 cells"):
        rm_anova(table, "y", "a", "s")


def test_between_groups_refusals(table: pd.DataFrame) -> None:
    with pytest.raises(BadOption, match="names 2 factors"):
        anova(table, "y", ["car", "variant"])
    with pytest.raises(TooFew, match="1 group"):
        anova(table[table["car"] == "BC3"], "y", "car")
    with pytest.raises(TooFew, match="every group of 'participant' has one value"):
        anova(table.drop_duplicates("participant"), "y", "participant")
    with pytest.raises(IncompleteCells, match="no value in column 'y' for row 3;"):
        anova(table.assign(y=table["y"].mask(table.index == 2)), "y", "car")
    with pytest.raises(DuplicatedCells, match="participants in more than one group: 'P000'"):
        anova(table, "y", "car", subject="participant")


def test_between_groups_counts_no_participant_twice(table: pd.DataFrame) -> None:
    grouped = table.assign(group=table["participant"].map(lambda p: "odd" if int(p[-1]) % 2 else "even"))
    with pytest.raises(DuplicatedCells, match=r"'P000' \(6 values\)"):
        anova(grouped, "y", "group", subject="participant")
    result = anova(grouped, "y", "group", subject="participant", aggregate="mean")
    assert result["ddof2"].tolist() == [6]
    assert result.attrs == {"group_sizes": {"even": 4, "odd": 4}, "dropped": [], "ratings_per_cell": (6, 6)}
    gap = grouped.assign(y=grouped["y"].mask(grouped.index == 0))
    with pytest.raises(IncompleteCells, match="for P000;"):
        anova(gap, "y", "group", subject="participant", aggregate="mean")
    left = anova(gap, "y", "group", subject="participant", aggregate="mean", missing="listwise")
    assert left.attrs["dropped"] == ["P000"]
    assert left["ddof2"].tolist() == [5]

"""What counts as a label: no NaN of any type, and no two that read the same; otherwise the type does not matter."""

from __future__ import annotations

from copy import copy
from decimal import Decimal

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import anova, pairwise_tests
from palpate.analysis.statistics.refusals import BadValue
from tests.analysis.statistics.anova_for_tests import long_table, tell


@pytest.mark.parametrize("kind", ["object", "str", "category"])
def test_a_row_without_a_label_is_refused(table: pd.DataFrame, kind: str) -> None:
    bad = table.assign(car=table["car"].mask(table.index == 6).astype(kind))
    assert tell(bad, BadValue).startswith("column 'car' has no label in row 7;")


NO_LABELS = [
    *(None, pd.NA, pd.NaT, np.nan, np.float32("nan"), np.float16("nan"), np.longdouble("nan")),
    *(
        Decimal("NaN"),
        Decimal("sNaN"),
        np.datetime64("NaT"),
        np.timedelta64("NaT"),
        complex("nan"),
        np.complex64("nan"),
    ),
]


@pytest.mark.parametrize("value", NO_LABELS, ids=repr)
@pytest.mark.parametrize("rows", [1, 200])
def test_every_kind_of_nan_is_a_missing_label(table: pd.DataFrame, value: object, rows: int) -> None:
    long = pd.concat([table] * rows, ignore_index=True)
    for column in ("car", "participant"):
        labels = long[column].astype(object)
        labels[[6, 7]] = pd.Series([value, copy(value)], index=[6, 7], dtype=object)
        bad = long.assign(**{column: labels})
        assert tell(bad, BadValue).startswith(f"column {column!r} has no label in row 7; row 8; name every row")
        with pytest.raises(BadValue, match="has no label in row 7; row 8;"):
            anova(bad, "y", column)


def test_missing_labels_are_no_groups() -> None:
    """Three NaN were three groups, each with a row."""
    table = pd.DataFrame(
        {"g": pd.Series([*"aabb", *([np.float32("nan")] * 3)], dtype=object), "y": np.arange(7.0) ** 2}
    )
    with pytest.raises(BadValue, match="column 'g' has no label in row 5; row 6; row 7;"):
        anova(table, "y", "g")


TWINS = [
    *[(1, "1", "1 and '1'"), (True, 1, "True and 1"), (True, "True", "True and 'True'"), (False, 0, "False and 0")],
    *[(1.0, "1", "1.0 and '1'"), (np.int64(1), "1", "np.int64(1) and '1'"), (np.True_, 1, "np.True_ and 1")],
    *[(0.5, "0.5", "0.5 and '0.5'"), (np.float32(0.1), 0.1, "np.float32(0.1) and 0.1")],
]


@pytest.mark.parametrize(("one", "other", "both"), TWINS, ids=repr)
@pytest.mark.parametrize("rows", [1, 200])
def test_labels_that_read_the_same_are_refused(
    table: pd.DataFrame, one: object, other: object, both: str, rows: int
) -> None:
    for first, second in ((one, other), (other, one)):
        labels = [first if variant == "0" else second for variant in table["variant"]]
        mixed = table.assign(variant=pd.Series(labels, dtype=object))
        mixed = pd.concat([mixed] * rows, ignore_index=True)
        expected = f"{both} both occur in column 'variant'; make the column one type"
        assert tell(mixed, BadValue) == expected
        with pytest.raises(BadValue, match="both occur in column 'variant'"):
            anova(mixed, "y", "variant")
        with pytest.raises(BadValue, match="both occur in column 'variant'"):
            pairwise_tests(mixed, "y", within="car", subject="variant")


@pytest.mark.parametrize("rows", [1, 200])
def test_categories_that_read_the_same_are_refused(table: pd.DataFrame, rows: int) -> None:
    labels = pd.Categorical([1 if variant == "0" else "1" for variant in table["variant"]])
    mixed = pd.concat([table.assign(variant=labels)] * rows, ignore_index=True)
    assert "1 and '1' both occur" in tell(mixed, BadValue)


def test_a_row_without_a_label_in_a_large_table() -> None:
    big = long_table(np.zeros((130, 40))).rename(columns={"subject": "participant"})
    bad = big.assign(A=big["A"].mask(big.index == 4999))
    assert "row 5000" in tell(bad, BadValue, within="A")


def test_labels_that_cannot_be_compared(table: pd.DataFrame) -> None:
    bad = table.assign(car=pd.Series([[1]] * len(table)))
    assert "cannot be compared" in tell(bad, BadValue)

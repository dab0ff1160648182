"""What counts as a value: nothing that a double cannot hold, whatever type the column has."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from palpate.analysis import rm_anova
from palpate.analysis.statistics.refusals import BadValue
from tests.analysis.statistics.anova_for_tests import same, tell


@pytest.mark.parametrize("kind", ["int64", "uint64", "Int64", "UInt64", "object"])
def test_integers_that_doubles_round_are_refused(table: pd.DataFrame, kind: str) -> None:
    huge = table.assign(y=pd.Series(2**60 + np.arange(len(table)), dtype=kind))
    message = tell(huge, BadValue)
    assert "holds numbers beyond 2**53, which a double rounds; found 1152921504606846977 in row 2;" in message
    exact = table.assign(y=pd.Series(2**60 + 2**20 * (np.arange(len(table)) % 7) ** 2, dtype=kind))
    assert rm_anova(exact, "y", "car", "participant", aggregate="mean")["F"].notna().all()


ROUNDED = [np.int64(2**60 + 1), np.uint64(2**64 - 1), Fraction(2**60 + 1), -(2**53) - 1]
TOO_LARGE = [10**400, -(10**5000), Fraction(10**400), Fraction(10**400, 3)]


@pytest.mark.parametrize("value", ROUNDED + TOO_LARGE, ids=lambda value: type(value).__name__)
def test_numbers_that_a_double_changes_are_refused_in_columns_of_objects(table: pd.DataFrame, value: object) -> None:
    values = pd.Series([*table["y"][:-1], value], dtype=object)
    message = tell(table.assign(y=values), BadValue)
    assert "holds numbers beyond 2**53, which a double rounds; found " in message
    assert message.endswith(" in row 48; subtract a constant first")
    assert len(message) < 200


def test_long_doubles_are_refused_only_where_a_whole_number_changes(table: pd.DataFrame) -> None:
    long = table["y"].astype(np.longdouble)
    assert same(
        rm_anova(table, "y", ["car", "variant"], "participant"),
        rm_anova(table.assign(y=long), "y", ["car", "variant"], "participant"),
    )
    tenths = table.assign(y=np.arange(len(table)).astype(np.longdouble) ** 2 / 10)
    assert rm_anova(tenths, "y", ["car", "variant"], "participant")["F"].notna().any()
    if np.finfo(np.longdouble).nmant > 53:
        for value in (np.longdouble(2) ** 60 + 1, np.longdouble(2) ** 16000):
            assert "2**53" in tell(table.assign(y=long.where(table.index != 3, value)), BadValue)


def test_decimal_numbers_are_refused_with_what_to_do(table: pd.DataFrame) -> None:
    decimals = table.assign(y=[Decimal(str(value)) for value in table["y"]])
    message = tell(decimals, BadValue)
    assert message.startswith("column 'y' holds Decimal numbers; found Decimal('")
    assert message.endswith("convert with astype(float)")
    converted = decimals.astype({"y": float})
    assert same(*(rm_anova(rows, "y", ["car", "variant"], "participant") for rows in (table, converted)))

"""Test-retest against R, and meetings that are missing, further or at one moment."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.reliability.repeated import Retest, retest
from palpate.analysis.statistics.refusals import DuplicatedCells, TooFew
from tests.analysis.reliability.tables import R, relative


def meetings(*columns: list[float], people: int = 5) -> pd.DataFrame:
    """The n-th value of each column is stimulus n // people of participant n % people, a column for each meeting."""
    return pd.DataFrame(
        [
            {"who": f"P{n % people}", "stimulus": n // people, "trial": 100 * turn + n, "y": value}
            for turn, values in enumerate(columns)
            for n, value in enumerate(values)
        ]
    )


def ask(table: pd.DataFrame, **options: object) -> Retest:
    return retest(table, "y", "who", "stimulus", "trial", **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", R["retest"])
def test_every_number_is_that_of_r(name: str) -> None:
    theirs = R["retest"][name]
    result = ask(meetings(theirs["first"], theirs["second"])).measures.set_index("measure")
    agreement, consistency = theirs["icc"][1], theirs["icc"][2]
    expected = {
        "Pearson r": (theirs["r"], theirs["r_low"], theirs["r_high"]),  # cor.test
        "ICC(A,1)": (agreement["ICC"], agreement["lower"], agreement["upper"]),  # psych::ICC
        "ICC(C,1)": (consistency["ICC"], consistency["lower"], consistency["upper"]),
        "bias, second - first": (theirs["bias"], theirs["bias_low"], theirs["bias_high"]),  # t.test
    }
    for measure, numbers in expected.items():
        ours = result.loc[measure, ["value", "ci_low", "ci_high"]]
        assert max(relative(a, b) for a, b in zip(ours, numbers, strict=True)) < 1e-12
    sd = theirs["sd_difference"]
    z = 1.959963984540054  # R: qnorm(.975)
    assert relative(result.loc["SEM, consistency", "value"], sd / np.sqrt(2)) < 1e-14
    assert relative(result.loc["smallest detectable change, consistency", "value"], z * sd) < 1e-14
    assert relative(result.loc["upper limit of agreement", "value"], theirs["bias"] + z * sd) < 1e-13
    difference = np.array(theirs["second"]) - np.array(theirs["first"])
    assert relative(result.loc["SEM, agreement", "value"], np.sqrt(np.mean(difference**2) / 2)) < 1e-14


def test_a_constant_shift_is_bias_and_no_error() -> None:
    result = ask(meetings([1.0, 2, 3, 5, 8, 4], [2.0, 3, 4, 6, 9, 5])).measures.set_index("measure")
    assert result.loc["ICC(C,1)", "value"] == result.loc["Pearson r", "value"] == 1
    assert result.loc["bias, second - first", "value"] == 1
    assert result.loc["SEM, consistency", "value"] == 0
    assert result.loc["SEM, agreement", "value"] == pytest.approx(np.sqrt(0.5))
    assert "do not vary" in result.loc["SD of the differences", "note"]


def test_third_meetings_and_missing_answers_are_counted() -> None:
    table = meetings([1.0, 2, 3, 5, 8, 4], [2.0, 2, np.nan, 6, 9, 5], [9.0] * 6)
    result = ask(table)
    assert (result.further, result.incomplete, len(result.pairs)) == (6, 1, 5)
    whole = table[(table["trial"] < 200) & ~table["trial"].isin([2, 102])]
    pd.testing.assert_frame_equal(result.measures, ask(whole).measures, check_exact=True)


def test_the_order_column_decides_and_not_the_rows() -> None:
    table = meetings([1.0, 2, 3, 5, 8, 4], [2.5, 3, 2, 6, 9, 5])
    mixed = table.sample(frac=1, random_state=4)
    pd.testing.assert_frame_equal(ask(table).measures, ask(mixed).measures, check_exact=True)
    pd.testing.assert_frame_equal(ask(table).people, ask(mixed).people, check_exact=True)
    turned = ask(table.assign(trial=-table["trial"])).measures
    assert turned.loc[3, "value"] == -ask(table).measures.loc[3, "value"]
    far = ask(table.assign(y=table["y"] + 1e9)).measures
    np.testing.assert_array_equal(far.loc[3:4, "value"], ask(table).measures.loc[3:4, "value"])


def test_each_person_has_a_line() -> None:
    result = ask(meetings([1.0, 2, 3, 5, 8, 4], [2.0, 3, 5, 6, 9, 3], people=2)).people
    assert result["who"].tolist() == ["P0", "P1"]
    assert result["pairs"].tolist() == [3, 3]
    assert result.loc[0, "bias"] == pytest.approx(4 / 3)
    assert result.loc[0, "r"] == pytest.approx(np.corrcoef([1, 3, 8], [2, 5, 9])[0, 1])


def test_refusals() -> None:
    with pytest.raises(TooFew, match="repeat stimuli"):
        ask(meetings([1.0, 2, 3]))
    with pytest.raises(DuplicatedCells, match="at the same moment"):
        ask(pd.concat([meetings([1.0, 2, 3])] * 2))

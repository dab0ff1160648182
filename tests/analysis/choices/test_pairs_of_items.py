"""Scales from pairs are R's, and refused where they do not exist."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis.choices.bradley_terry import bradley_terry
from palpate.analysis.choices.scales import differences
from palpate.analysis.choices.thurstone import thurstone
from palpate.analysis.choices.triads import circular_triads
from palpate.analysis.statistics.refusals import (
    BadOption,
    BadValue,
    IncompleteCells,
    NoEstimate,
    StatisticsError,
    UnknownColumn,
)
from tests.analysis.choices.choices_for_tests import baseball, choices, in_r, with_ties
from tests.examples import examples

PUBLISHED = {"Milwaukee": 1.58, "Detroit": 1.44, "Toronto": 1.29, "New York": 1.25, "Boston": 1.11, "Cleveland": 0.68}


def against(result: pd.DataFrame, expected: dict[str, float], prefix: str, column: str) -> None:
    values = result.set_index("item")[column]
    for name, value in expected.items():
        if name.startswith(prefix):
            assert values[name.removeprefix(prefix)] == pytest.approx(value, rel=1e-8)


def test_worths_are_those_of_r_and_of_the_textbook() -> None:
    result = bradley_terry(baseball(), "winner", "loser", count="count", constraint="Baltimore")
    expected = in_r()["bradley_terry"]
    against(result.values, expected["coefficients"], "Xp", "value")
    against(result.values, expected["se"], "Xp", "se")
    assert (result.deviance, result.df) == (pytest.approx(expected["deviance"], rel=1e-9), expected["df"])
    teams = list(PUBLISHED)
    assert result.covariance.loc[teams, teams].to_numpy() == pytest.approx(np.array(expected["vcov"]), rel=1e-7)
    assert result.values.set_index("item")["value"].round(2)[teams].to_dict() == PUBLISHED  # Agresti 2002, 10.6.2


def test_the_advantage_of_the_first_place_is_that_of_r() -> None:
    result = bradley_terry(baseball(), "winner", "loser", first="home", count="count", constraint="Baltimore")
    expected = in_r()["bradley_terry_home"]
    home = result.effects.set_index("effect").loc["position"]
    assert home["estimate"] == pytest.approx(expected["coefficients"]["(Intercept)"], rel=1e-8)
    assert home["se"] == pytest.approx(expected["se"]["(Intercept)"], rel=1e-8)
    against(result.values, expected["coefficients"], "X", "value")
    assert (result.deviance, result.df) == (pytest.approx(expected["deviance"], rel=1e-9), expected["df"])


@pytest.mark.parametrize("order", [False, True])
def test_ties_are_those_of_davidson_in_r(order: bool) -> None:
    first = "first" if order else None
    result = bradley_terry(with_ties(), "winner", "loser", "tie", first, "count", constraint="a")
    expected = in_r()["davidson_order" if order else "davidson"]
    effects = result.effects.set_index("effect")
    against(result.values, {k: v for k, v in expected["coefficients"].items() if len(k) == 1}, "", "value")
    assert effects.loc["tie", "estimate"] == pytest.approx(expected["coefficients"]["tie"], rel=1e-8)
    assert effects.loc["tie", "se"] == pytest.approx(expected["se"]["tie"], rel=1e-8)
    if order:
        assert effects.loc["position", "estimate"] == pytest.approx(-expected["coefficients"]["second"], rel=1e-8)
    assert (result.deviance, result.df) == (pytest.approx(expected["deviance"], rel=1e-9), expected["df"])


def test_the_probit_scale_is_that_of_r() -> None:
    result, expected = thurstone(baseball(), "winner", "loser", "count", constraint="Baltimore"), in_r()["thurstone"]
    against(result.values, expected["coefficients"], "Xp", "value")
    against(result.values, expected["se"], "Xp", "se")
    assert (result.deviance, result.df) == (pytest.approx(expected["deviance"], rel=1e-9), expected["df"])


def test_differences_do_not_depend_on_the_constraint() -> None:
    one = bradley_terry(baseball(), "winner", "loser", count="count")
    two = bradley_terry(baseball(), "winner", "loser", count="count", constraint="Toronto")
    assert one.values["value"].sum() == pytest.approx(0, abs=1e-12)
    numbers = ["difference", "se", "z", "p", "p_corrected"]
    assert differences(one)[numbers].to_numpy() == pytest.approx(differences(two)[numbers].to_numpy(), rel=1e-9)
    assert one.values["worth"].sum() == pytest.approx(1)
    assert (differences(one)["p"] > 0).all()


@settings(max_examples=examples(8), deadline=None)
@given(st.integers(0, 10**6))
def test_order_repetition_and_types_of_labels_change_nothing(seed: int) -> None:
    table = baseball().loc[lambda t: t["count"] > 0]
    single = table.loc[table.index.repeat(table["count"])].drop(columns="count").sample(frac=1, random_state=seed)
    numbered = single.replace({name: i for i, name in enumerate(sorted(table["winner"].unique()))})
    one = bradley_terry(table, "winner", "loser", count="count").values.drop(columns="item")
    for other in (single, numbered, single.astype("category")):
        assert one.equals(bradley_terry(other, "winner", "loser").values.drop(columns="item"))


def test_perfect_data_have_no_scale_and_the_items_are_named() -> None:
    with pytest.raises(NoEstimate, match="'a' never lost to any"):
        bradley_terry(choices("ab ac bc cb"), "winner", "loser")
    with pytest.raises(NoEstimate, match="'c' never beat any"):
        thurstone(choices("ab ba ac bc"), "winner", "loser")
    with pytest.raises(NoEstimate, match="never compared with each other \\('a', 'b' and 'c', 'd'\\)"):
        bradley_terry(choices("ab ba cd dc"), "winner", "loser")
    with pytest.raises(NoEstimate, match="'a', 'b' never lost"):
        bradley_terry(choices("ab ba cd dc ac bd"), "winner", "loser")
    assert issubclass(NoEstimate, StatisticsError)


def test_a_tie_links_items_but_only_the_first_place_winning_has_no_estimate() -> None:
    tied = choices("ab bc").assign(tie=False)
    tied = pd.concat([tied, choices("ab bc ac").assign(tie=True)])
    assert np.isfinite(bradley_terry(tied, "winner", "loser", "tie").values["value"]).all()
    first = choices("ab bc ca ba cb ac").assign(first=lambda t: t["winner"])
    with pytest.raises(NoEstimate, match="'position'|position"):
        bradley_terry(first, "winner", "loser", first="first")
    with pytest.raises(NoEstimate, match="no comparison was tied"):
        bradley_terry(choices("ab ba").assign(tie=False), "winner", "loser", "tie")


def test_wrong_tables_are_refused() -> None:
    with pytest.raises(BadValue, match="itself: 'a' in row 2"):
        bradley_terry(choices("ab aa"), "winner", "loser")
    with pytest.raises(BadValue, match="whole|count"):
        bradley_terry(choices("ab ba").assign(n=[1.5, 2]), "winner", "loser", count="n")
    with pytest.raises(UnknownColumn, match="'x' is not one of the items"):
        bradley_terry(choices("ab ba"), "winner", "loser", constraint="x")
    with pytest.raises(BadValue, match="neither winner nor loser in row 1"):
        bradley_terry(choices("ab ba").assign(first=["c", "a"]), "winner", "loser", first="first")
    with pytest.raises(BadOption, match="method='ls'"):
        thurstone(choices("ab ba"), "winner", "loser", method="ls")  # type: ignore[arg-type]
    with pytest.raises(BadValue, match="no comparison"):
        bradley_terry(choices("ab").assign(n=0), "winner", "loser", count="n")


def test_least_squares_is_the_mean_of_the_deviates() -> None:
    counts = pd.DataFrame(
        [("a", "b", 60), ("b", "a", 40), ("a", "c", 80), ("c", "a", 20), ("b", "c", 70), ("c", "b", 30)],
        columns=["winner", "loser", "n"],
    )
    result = thurstone(counts, "winner", "loser", "n", "least_squares").values["value"].tolist()
    z = {0.6: 0.2533471031357997, 0.8: 0.8416212335729143, 0.7: 0.5244005127080407}  # R's qnorm
    assert result == pytest.approx([(z[0.6] + z[0.8]) / 3, (z[0.7] - z[0.6]) / 3, (-z[0.8] - z[0.7]) / 3], rel=1e-12)
    likely = thurstone(counts, "winner", "loser", "n").values["value"].tolist()
    assert likely == pytest.approx(result, abs=0.02)
    with pytest.raises(IncompleteCells, match="'a' and 'b'"):
        thurstone(choices("ab bc cb ca ac"), "winner", "loser", method="least_squares")


def test_circular_triads_are_counted() -> None:
    one = choices("ab bc ca ad bd cd").assign(who="P1")
    two = choices("ab ac ad bc bd cd").assign(who="P2")
    three = choices("ab bc ca").assign(who="P3")
    result = circular_triads(pd.concat([one, two, three]), "winner", "loser", "who").set_index("who")
    assert result.loc["P1", ["triads", "circular", "consistence"]].tolist() == [4, 1, 0.5]
    assert result.loc["P2", ["triads", "circular", "consistence"]].tolist() == [4, 0, 1.0]
    assert result.loc["P3", ["triads", "circular"]].tolist() == [1, 1]
    assert np.isnan(result.loc["P3", "consistence"])
    assert result.loc["all together", "circular"] == 1


def test_kendalls_largest_number_of_circular_triads() -> None:
    wheel = choices(" ".join(f"{i}{(i + step) % 7}" for i in range(7) for step in (1, 2, 3)))
    assert circular_triads(wheel, "winner", "loser").loc[0, ["circular", "consistence"]].tolist() == [14, 0.0]

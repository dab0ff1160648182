"""Scales from pairs are R's, and refused where they do not exist."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import t

from palpate.analysis.choices.bradley_terry import bradley_terry
from palpate.analysis.choices.scales import differences
from palpate.analysis.choices.thurstone import thurstone
from palpate.analysis.choices.triads import chance_of_circular, circular_triads, ways_to_be_circular
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


@pytest.mark.parametrize(
    ("items", "ways"),
    [
        (4, [24, 16, 24]),
        (5, [120, 120, 240, 240, 280, 24]),
        (6, [720, 960, 2240, 2880, 6240, 3648, 8640, 4800, 2640]),
        (7, [5040, 8400, 21840, 33600, 75600, 90384, 179760, 188160, 277200, 280560, 384048, 244160, 233520, 72240,
             2640]),
    ],
)  # fmt: skip
def test_the_chance_of_so_few_circular_triads_is_kendalls(items: int, ways: list[int]) -> None:
    """Kendall & Babington Smith 1940, table of the frequencies of circular triads."""
    assert [count for _, count in sorted(ways_to_be_circular(items).items())] == ways
    assert chance_of_circular(items, 1) == sum(ways[:2]) / sum(ways)
    assert chance_of_circular(items, len(ways) - 1) == 1


def test_kendalls_chi_squared_goes_on_where_the_exact_chance_ends() -> None:
    """The counts of ten items come from enumeration by the same function, which takes two seconds: .0380 for 20."""
    assert chance_of_circular(10, 20) == pytest.approx(0.038, abs=0.015)
    everybody = choices("ab bc ca ad bd cd").assign(who="P1")
    assert circular_triads(everybody, "winner", "loser", "who")["p"].tolist() == [40 / 64, 40 / 64]


def of_people(people: int, differ: float, seed: int) -> pd.DataFrame:
    """Return how often each of `people` chose one of five items over another, each pair four times.

    A person's values are the items' own and a normal deviation with the SD `differ`, in logits.
    """
    rng = np.random.default_rng(seed)
    rows = []
    for who in range(people):
        value = np.array(POPULATION) + differ * rng.standard_normal(5)
        for one, two in combinations(range(5), 2):
            won = int(rng.binomial(4, 1 / (1 + np.exp(value[two] - value[one]))))
            rows += [(who, one, two, won), (who, two, one, 4 - won)]
    return pd.DataFrame(rows, columns=["who", "winner", "loser", "n"])


POPULATION = (-0.8, -0.4, 0.0, 0.4, 0.8)


def missed_middle(studies: int, participant: str | None) -> float:
    """Return how many 95 % intervals of the middle item, whose value is 0 for everybody together, do not hold it."""
    missed = 0
    for seed in range(studies):
        table = of_people(10, 0.8, seed)
        result = bradley_terry(table, "winner", "loser", count="n", participant=participant).values
        low, high = result.loc[2, ["ci_low", "ci_high"]].tolist()
        missed += not low <= 0 <= high
    return missed / studies


@pytest.mark.long
def test_intervals_over_people_hold_the_value_where_people_differ() -> None:
    """Of 200 studies 95.4 to 96.2 % hold it over people and 77 % over choices (docs/reference/choices.md).

    The limits are 3 standard errors of a share off .05 and .23.
    """
    studies = 100
    assert missed_middle(studies, "who") < 0.05 + 3 * np.sqrt(0.05 * 0.95 / studies)
    assert missed_middle(studies, None) > 0.23 - 3 * np.sqrt(0.23 * 0.77 / studies)


@pytest.mark.parametrize("model", [bradley_terry, thurstone])
def test_standard_errors_over_people_are_those_of_leaving_each_out(model: Any) -> None:
    """Of two items, one step from the estimate without a person is (w - n p) / (sum of the others' n) p q for logits.

    For the probit, w - n p and n p q are multiplied by the density over p q, and its curvature.
    """
    won, trials = np.array([9, 5, 7, 2]), np.array([10, 8, 9, 6])
    table = pd.DataFrame(
        {"who": [*range(4)] * 2, "winner": [*"aaaabbbb"], "loser": [*"bbbbaaaa"], "n": [*won, *(trials - won)]}
    )
    result = model(table, "winner", "loser", count="n", constraint="b", participant="who")
    one, two = result.values.loc[0, ["value", "se"]].tolist()
    p = won.sum() / trials.sum()
    if model is bradley_terry:
        slope, bend = won - trials * p, trials * p * (1 - p)
    else:
        density = np.exp(-one * one / 2) / np.sqrt(2 * np.pi)
        up, down = density / p, density / (1 - p)
        slope = won * up - (trials - won) * down
        bend = won * up * (one + up) + (trials - won) * down * (down - one)
    steps = -slope / (bend.sum() - bend)
    assert two == pytest.approx(np.sqrt(3 / 4 * ((steps - steps.mean()) ** 2).sum()), rel=1e-9)
    assert result.people == 4
    (row,) = differences(result).to_dict("records")
    assert row["t"] == pytest.approx(one / two)
    assert row["p"] == pytest.approx(2 * t.sf(abs(one / two), 3), rel=1e-9)


def test_one_person_is_no_sample_and_somebody_who_cannot_be_left_out_is_named() -> None:
    one = choices("ab ba ac ca bc cb").assign(who="P1")
    alone = bradley_terry(one, "winner", "loser", participant="who")
    assert alone.people == 0
    assert alone.values.equals(bradley_terry(one, "winner", "loser").values)
    two = choices("ad da").assign(who="P2")
    result = bradley_terry(pd.concat([one, two, one.assign(who="P3")]), "winner", "loser", participant="who")
    assert result.values["se"].isna().all()
    assert result.values["value"].notna().all()
    assert any("without 'P2' the comparisons fix no scale" in note for note in result.notes)


def test_people_who_all_chose_alike_have_no_standard_error() -> None:
    alike = pd.concat([choices("ab ba ac ac ca bc cb").assign(who=who) for who in ("P1", "P2", "P3")])
    result = bradley_terry(alike, "winner", "loser", participant="who")
    assert result.values["se"].isna().all()
    assert differences(result)[["se", "p", "p_corrected"]].isna().all(axis=None)
    assert any("all of them chose alike" in note for note in result.notes)

"""Mixed ANOVA on what breaks it: huge offsets, no residual, gaps, empty groups, odd labels; what must not matter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.analysis import StatisticsError, anova, rm_anova
from palpate.analysis.statistics.apa import apa_f
from palpate.analysis.statistics.exact import self_check
from palpate.analysis.statistics.hypotheses import EXACT_GROUPS
from palpate.analysis.statistics.mixed_anova import mixed_anova
from tests.analysis.statistics.anova_for_tests import relative_error, same
from tests.analysis.statistics.variance_for_tests import UNEQUAL, design
from tests.examples import examples

OPTIONS: dict[str, Any] = {"within": ["A", "B"], "between": ["g", "h"], "subject": "subject"}
FREE = ("F", "p_unc", "p_GG_corr", "eps", "np2", "ng2")


def result(table: pd.DataFrame, **options: Any) -> pd.DataFrame:
    return mixed_anova(table, "y", **{**OPTIONS, **options})


@pytest.mark.parametrize("kind", ["II", "III"])
@pytest.mark.parametrize("offset", [1e9, -1e12])
def test_an_offset_changes_no_digit(kind: str, offset: float) -> None:
    whole = design(UNEQUAL).assign(y=lambda table: (10 * table["y"]).round())
    assert same(
        result(whole, sum_of_squares=kind).drop(columns="note"),
        result(whole.assign(y=whole["y"] + offset), sum_of_squares=kind).drop(columns="note"),
    )


@pytest.mark.parametrize("column", ["subject", "g", "A"])
def test_a_huge_effect_costs_the_others_no_digit(column: str) -> None:
    """1e9 between participants, groups or conditions: exact fractions on the same doubles agree."""
    table = design(UNEQUAL)
    place = pd.factorize(table[column])[0]
    result = self_check(table.assign(y=(10 * table["y"]).round() + 1e9 * place), "y", **OPTIONS)
    assert result["checked"].all()
    assert result["difference"].max() < 1e-13


def test_against_the_tests_it_contains() -> None:
    table = design({("u", "f"): 4, ("u", "m"): 4, ("v", "f"): 4, ("v", "m"): 4})
    within = mixed_anova(table, "y", within=["A", "B"], subject="subject")
    plain = rm_anova(table, "y", ["A", "B"], "subject")
    np.testing.assert_allclose(within[list(FREE)].to_numpy(), plain[list(FREE)].to_numpy(), rtol=1e-14)
    one = table[(table["A"] == "a0") & (table["B"] == "b0")]
    ours, theirs = mixed_anova(one, "y", between="g"), anova(one, "y", "g")
    for column in ("SS", "F", "p_unc", "np2"):
        assert relative_error(ours[column][0], theirs[column][0]) < 1e-14


@settings(max_examples=examples(10), deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["II", "III"]))
def test_the_order_of_rows_and_columns_and_the_type_of_labels_change_no_bit(seed: int, kind: str) -> None:
    table = design(UNEQUAL, seed=seed % 97)
    plain = result(table, sum_of_squares=kind)
    mixed = table.sample(frac=1, random_state=seed)[["h", "y", "B", "subject", "g", "A"]]
    assert same(plain, result(mixed, sum_of_squares=kind))
    coded = table.assign(g=(table["g"] == "v").astype(int), A=table["A"].str[1:].astype("int64"))
    numbers = plain.columns.drop(["Source", "note"])
    assert same(plain[numbers], result(coded.astype({"h": "category"}), sum_of_squares=kind)[numbers])


@settings(max_examples=examples(25), deadline=None)
@given(st.integers(-300, 300), st.integers(0, 50))
def test_the_unit_changes_no_f(exponent: int, seed: int) -> None:
    table = design(UNEQUAL, seed=seed)
    scaled = result(table.assign(y=np.ldexp(table["y"], exponent)))
    assert same(result(table)[list(FREE)], scaled[list(FREE)])


def test_rows_that_are_nobodys_may_come_in_any_order() -> None:
    table = design(UNEQUAL, k=(1, 1))
    for kind in ("II", "III"):
        result = [mixed_anova(t, "y", between=["g", "h"], sum_of_squares=kind) for t in (table, table.iloc[::-1])]
        assert same(*result)


def test_the_names_of_groups_and_effects() -> None:
    answer = result(design(UNEQUAL))
    assert answer["Source"].tolist()[:6] == ["g", "h", "g:h", "A", "g:A", "h:A"]
    assert answer["d"].tolist()[:4] == [1, 1, 1, 2]
    assert answer.attrs["group_sizes"]["'g' = 'u' and 'h' = 'm'"] == 5
    assert "Greenhouse" not in apa_f(answer.iloc[0])
    assert "Greenhouse" in apa_f(answer.iloc[3])
    three = design({("u", "f"): 3, ("v", "f"): 4, ("w", "f"): 3})
    between = mixed_anova(three, "y", within=["A", "B"], between="g", subject="subject").iloc[0]
    assert (between["ddof1"], between["eps"]) == (2, 1.0)
    assert "Greenhouse" not in apa_f(between)


def test_more_groups_than_are_solved_in_integers() -> None:
    """30 unequal groups of 5 x 6 go through doubles; an offset of 1e9 still costs nothing that can be seen."""
    rng = np.random.Generator(np.random.PCG64(4))
    sizes = {(f"g{i}", f"h{j}"): int(rng.integers(1, 4)) for i in range(5) for j in range(6)}
    assert len(sizes) > EXACT_GROUPS
    table = design(sizes, k=(3, 1)).assign(y=lambda t: (10 * t["y"]).round())
    factors: dict[str, Any] = {"within": "A", "between": ["g", "h"], "subject": "subject", "sum_of_squares": "II"}
    plain, moved = (mixed_anova(table.assign(y=table["y"] + add), "y", **factors) for add in (0.0, 1e9))
    np.testing.assert_allclose(plain["F"], moved["F"], rtol=1e-12)
    checked = self_check(table, "y", **factors)
    assert not checked["checked"].any()
    assert checked["note"].str.contains("30 groups of different sizes").all()


def test_no_residual_is_no_f() -> None:
    table = design(UNEQUAL)
    for values in (0.3, 100.0, (table["g"] == "u") * 0.1 + (table["A"] == "a1") * 0.3):
        answer = result(table.assign(y=values))
        assert answer[["F", "p_unc", "p_GG_corr"]].isna().all(axis=None)
        assert answer["note"].str.startswith("F is undefined").all()


def test_fewer_participants_than_contrasts() -> None:
    result = mixed_anova(
        design({("u", "f"): 3, ("v", "f"): 2}, k=(6, 1)), "y", within="A", between="g", subject="subject"
    )
    row = result.set_index("Source").loc["A"]
    assert np.isnan(row["eps_HF"])
    assert 0 < row["p_GG_corr"] < 1
    assert "Huynh-Feldt is undefined" in row["note"]


def _moved(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(g=["v", *table["g"].iloc[1:]])


REFUSED: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame], dict[str, Any]]] = [
    ("participants with several levels of 'g': 'uf0'", _moved, {}),
    ("no participant has 'g' = 'u' and 'h' = 'm'", lambda t: t[~t["subject"].str.startswith("um")], {}),
    ("factor 'h' has one level, 'f'", lambda t: t[t["h"] == "f"], {}),
    ("1 cell missing in all", lambda t: t.iloc[1:], {}),
    ("several values in one cell", lambda t: pd.concat([t, t.iloc[:1]]), {}),
    ("sum_of_squares='I' is unknown", lambda t: t, {"sum_of_squares": "I"}),
    ("no factor is named", lambda t: t, {"within": None, "between": None}),
    ("within needs `subject`", lambda t: t, {"subject": None}),
    ("named twice", lambda t: t, {"between": ["g", "g"]}),
    (
        "two effects have the same name: 'g:h'",
        lambda t: t.assign(**{"g:h": t["A"]}),
        {"within": "g:h", "aggregate": "mean"},
    ),
    ("1 and '1' both occur in column 'g'", lambda t: t.assign(g=[1, "1"] * (len(t) // 2)), {}),
    ("every group has one participant", lambda t: t[t["subject"].str.endswith("0")], {}),
]


@pytest.mark.parametrize(("message", "change", "options"), REFUSED, ids=[message for message, *_ in REFUSED])
def test_what_is_refused(message: str, change: Callable[[pd.DataFrame], pd.DataFrame], options: dict[str, Any]) -> None:
    with pytest.raises(StatisticsError) as caught:
        result(change(design(UNEQUAL)), **options)
    assert message in str(caught.value)


def test_listwise_leaves_participants_out_of_their_group() -> None:
    table = design(UNEQUAL)
    answer = result(table.iloc[1:], missing="listwise")
    assert answer.attrs["dropped"] == ["uf0"]
    np.testing.assert_array_equal(answer["F"], result(table[table["subject"] != "uf0"])["F"])


def test_labels_that_programs_lose() -> None:
    table = design(UNEQUAL)
    odd = table.assign(g=table["g"].map({"u": "None", "v": "nan"}), subject=table["subject"] + ":1")
    np.testing.assert_array_equal(result(odd)["F"], result(table)["F"])

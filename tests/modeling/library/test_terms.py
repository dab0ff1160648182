"""The words: their ranges keep the rules that the reference states, and no word means two things."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.terms import (
    FILE,
    Soft,
    Word,
    both,
    in_words,
    known_words,
    mirrored,
    trapezoid,
    vocabulary,
)
from palpate.modeling.library.wishes import wishes_in
from tests.modeling.library.library_for_tests import PAIRS


@pytest.fixture
def terms():
    import yaml

    return yaml.safe_load(FILE.read_text(encoding="utf-8"))


def test_no_edge_is_steeper_than_a_just_noticeable_difference(terms):
    for name, edges in terms["degrees"].items():
        ends = [(edges[0], edges[1]), (edges[2], edges[3])]
        assert all(high - low >= 10 for low, high in ends if low is not None), name
        assert all(low <= high for low, high in pairwise([edge for edge in edges if edge is not None])), name


def test_not_is_the_opposite_of_what_it_denies(terms):
    for positive, negative in (("", "not"), ("very", "not very"), ("extremely", "not extremely")):
        one, other = (trapezoid(terms["degrees"][name]) for name in (positive, negative))
        assert all(one.at(x) + other.at(x) == pytest.approx(1) for x in range(101))


def test_the_stronger_word_asks_for_more(terms):
    full = [trapezoid(terms["degrees"][name]).half_fit[0] for name in ("slightly", "fairly", "", "very", "extremely")]
    assert full == sorted(full) and len(set(full)) == 5


def test_no_word_means_two_things(terms):
    every = [word for words in terms["synonyms"].values() for word in words] + list(terms["synonyms"])
    sayings = [saying for part in ("sayings", "numbers") for words in terms[part].values() for saying in words]
    assert all(isinstance(term, str) for term in (*every, *sayings, *terms["silent"]))
    assert len({*every, *sayings, *terms["degrees"], *terms["silent"]}) == len(every) + len(sayings) + len(
        terms["degrees"]
    ) + len(terms["silent"])


def test_every_word_for_a_number_and_a_degree_names_one_that_there_is(terms):
    assert set(terms["sayings"]) <= set(terms["degrees"])
    assert set(terms["numbers"]) == {"at least", "at most", "about"}


def test_a_library_with_its_own_attributes_knows_its_own_words():
    known = vocabulary([("Dry", "Wet"), ("Even", "Rippled")])
    assert known.words["even",] == Word(
        1, False
    )  # a word of its own, not the other word for smooth that it is elsewhere
    (wish,) = wishes_in(["very wet"], known)
    assert (wish.pair, wish.soft.half_fit) == (0, (77.5, 100))
    with pytest.raises(LibraryError, match="not known as rough or not, only by Dry-Wet, Even-Rippled"):
        wishes_in(["coarse"], known)


def test_all_that_is_known_is_reported():
    text = known_words(vocabulary(PAIRS))
    assert text.startswith("Words: rough (coarse, scratchy") and "slightly (a bit, a little)" in text


@pytest.mark.parametrize(
    ("value", "expected"),
    [(50, "neither rough nor smooth"), (45, "neither rough nor smooth"), (41, "a bit rough"), (33, "rough"),
     (20, "very rough"), (5, "extremely rough"), (60, "a bit smooth"), (63, "smooth"), (100, "extremely smooth")],
)  # fmt: skip
def test_a_value_has_a_name(value, expected):
    assert in_words(vocabulary(PAIRS), 0, value) == expected


def test_the_reference_tells_the_same_numbers(terms):
    page = (FILE.parents[2] / "docs" / "reference" / "texture-library.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in page.splitlines() if line[:1] == "|"]
    shown = {row[0]: [float(cell) if cell else None for cell in row[1:5]] for row in rows if row[0] in terms["degrees"]}
    assert shown == {name: edges for name, edges in terms["degrees"].items() if name}
    assert ["(the word alone)", *map(str, terms["degrees"][""][:2])] in [row[:3] for row in rows]


EDGES = ((55, 70, None, None), (None, None, 20, 35), (45, 55, 70, 80), (30, 45, 55, 70))
value, sd = st.floats(-20, 120), st.floats(0, 40)
edges = st.sampled_from(EDGES)


@pytest.mark.parametrize("shape", EDGES)
@pytest.mark.parametrize(("mean", "spread"), [(50, 5), (62, 1), (10, 30), (71, 0.2), (100, 12)])
def test_the_expected_membership_is_that_of_scipy_s_integration(shape, mean, spread):
    soft = trapezoid(shape)
    pieces = sorted({mean - 9 * spread, mean + 9 * spread, *(x for x, _ in soft.knots)})
    inside = [x for x in pieces if mean - 9 * spread <= x <= mean + 9 * spread]
    expected = sum(
        quad(lambda x: soft.at(x) * norm.pdf(x, mean, spread), low, high, epsabs=1e-12)[0]
        for low, high in pairwise(inside)
    )
    assert soft.expected(mean, spread) == pytest.approx(expected, abs=1e-9)


def test_what_is_known_for_sure_has_its_own_membership():
    soft = trapezoid((45, 55, 70, 80))
    assert [soft.at(x) for x in (0, 45, 50, 55, 60, 70, 75, 80, 100)] == [0, 0, 0.5, 1, 1, 1, 0.5, 0, 0]
    assert trapezoid((None, None, None, None)).at(3) == 1


@given(edges, value, sd)
def test_it_lies_between_none_and_all(shape, mean, spread):
    assert 0 <= trapezoid(shape).expected(mean, spread) <= 1


@given(edges, value, sd, st.floats(0, 30))
def test_less_certainty_never_helps_a_value_that_fits_for_sure(shape, mean, spread, more):
    soft = trapezoid(shape)
    if soft.at(mean) == 1:
        assert soft.expected(mean, spread + more) <= soft.expected(mean, spread) + 1e-9


@given(edges, value, sd, st.floats(0, 30))
def test_less_certainty_never_harms_a_value_that_surely_does_not_fit(shape, mean, spread, more):
    soft = trapezoid(shape)
    ends = [x for x, member in soft.knots if member == 0]
    beyond = soft.at(mean) == 0 and all(abs(mean - x) > 2 * (spread + more) for x in ends)
    if beyond:
        assert soft.expected(mean, spread + more) >= soft.expected(mean, spread) - 1e-9


@given(value, value, sd)
def test_nearer_to_the_word_fits_no_worse(one, other, spread):
    soft = trapezoid((55, 70, None, None))
    low, high = sorted((one, other))
    assert soft.expected(low, spread) <= soft.expected(high, spread) + 1e-9


@pytest.mark.parametrize("spread", [1e-320, 1e-12, 1e-9, 1e-6, 1e6, 1e12])
def test_spreads_beyond_all_measure_give_a_number(spread):
    value = trapezoid((45, 55, 70, 80)).expected(60, spread)
    assert value == pytest.approx(1 if spread < 1 else 0, abs=1e-4)


@given(edges, value, sd)
def test_a_range_seen_from_the_other_end_is_the_same_range(shape, mean, spread):
    soft = trapezoid(shape)
    assert mirrored(soft).expected(100 - mean, spread) == pytest.approx(soft.expected(mean, spread), abs=1e-9)


@given(edges, edges, st.floats(0, 100))
def test_both_is_the_lesser_of_two_everywhere_also_where_their_edges_cross(one, other, x):
    first, second = trapezoid(one), trapezoid(other)
    assert both(first, second).at(x) == pytest.approx(min(first.at(x), second.at(x)), abs=1e-9)
    assert both(second, first).at(x) == pytest.approx(both(first, second).at(x), abs=1e-9)


def test_the_best_of_a_range_and_where_it_is_fulfilled_by_half():
    assert trapezoid((45, 55, 70, 80)).best == 1 and trapezoid((45, 55, 70, 80)).half_fit == (50, 75)
    apart = both(trapezoid((None, None, 30, 45)), trapezoid((55, 70, None, None)))
    assert apart.best == 0 and apart.half_fit is None
    assert Soft(((120.0, 0.0), (130.0, 1.0))).best == 0  # no value on the scale gets there
    assert math.isclose(both(trapezoid((0, 100, None, None)), trapezoid((None, None, 0, 100))).best, 0.5)

"""The words: their ranges keep the rules that the reference states, and no word means two things."""

from itertools import pairwise

import pytest

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.ranges import trapezoid
from palpate.modeling.library.terms import FILE, Word, in_words, known_words, vocabulary
from palpate.modeling.library.wishes import wishes_in
from tests.modeling.library.made_library import PAIRS


@pytest.fixture
def told():
    import yaml

    return yaml.safe_load(FILE.read_text(encoding="utf-8"))


def test_no_edge_is_steeper_than_a_just_noticeable_difference(told):
    for name, edges in told["degrees"].items():
        ends = [(edges[0], edges[1]), (edges[2], edges[3])]
        assert all(high - low >= 10 for low, high in ends if low is not None), name
        assert all(low <= high for low, high in pairwise([each for each in edges if each is not None])), name


def test_not_is_the_opposite_of_what_it_denies(told):
    for positive, negative in (("", "not"), ("very", "not very"), ("extremely", "not extremely")):
        one, other = (trapezoid(told["degrees"][name]) for name in (positive, negative))
        assert all(one.at(x) + other.at(x) == pytest.approx(1) for x in range(101))


def test_the_stronger_word_asks_for_more(told):
    full = [trapezoid(told["degrees"][name]).met[0] for name in ("slightly", "fairly", "", "very", "extremely")]
    assert full == sorted(full) and len(set(full)) == 5


def test_no_word_means_two_things(told):
    every = [word for words in told["synonyms"].values() for word in words] + list(told["synonyms"])
    sayings = [each for part in ("sayings", "numbers") for words in told[part].values() for each in words]
    assert all(isinstance(each, str) for each in (*every, *sayings, *told["silent"]))
    assert len({*every, *sayings, *told["degrees"], *told["silent"]}) == len(every) + len(sayings) + len(
        told["degrees"]
    ) + len(told["silent"])


def test_every_word_for_a_number_and_a_degree_names_one_that_there_is(told):
    assert set(told["sayings"]) <= set(told["degrees"])
    assert set(told["numbers"]) == {"at least", "at most", "about"}


def test_a_library_with_its_own_attributes_knows_its_own_words():
    known = vocabulary([("Dry", "Wet"), ("Even", "Rippled")])
    assert known.words["even",] == Word(
        1, False
    )  # a word of its own, not the other word for smooth that it is elsewhere
    (wish,) = wishes_in(["very wet"], known)
    assert (wish.pair, wish.soft.met) == (0, (77.5, 100))
    with pytest.raises(LibraryError, match="not known as rough or not, only by Dry-Wet, Even-Rippled"):
        wishes_in(["coarse"], known)


def test_all_that_is_known_is_told():
    text = known_words(vocabulary(PAIRS))
    assert text.startswith("Words: rough (coarse, scratchy") and "slightly (a bit, a little)" in text


@pytest.mark.parametrize(
    ("value", "expected"),
    [(50, "neither rough nor smooth"), (45, "neither rough nor smooth"), (41, "a bit rough"), (33, "rough"),
     (20, "very rough"), (5, "extremely rough"), (60, "a bit smooth"), (63, "smooth"), (100, "extremely smooth")],
)  # fmt: skip
def test_a_value_has_a_name(value, expected):
    assert in_words(vocabulary(PAIRS), 0, value) == expected


def test_the_reference_tells_the_same_numbers(told):
    page = (FILE.parents[2] / "docs" / "reference" / "texture-library.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in page.splitlines() if line[:1] == "|"]
    shown = {row[0]: [float(cell) if cell else None for cell in row[1:5]] for row in rows if row[0] in told["degrees"]}
    assert shown == {name: edges for name, edges in told["degrees"].items() if name}
    assert ["(the word alone)", *map(str, told["degrees"][""][:2])] in [row[:3] for row in rows]

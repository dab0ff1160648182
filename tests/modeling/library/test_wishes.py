"""The language of wishes: what is understood, as which values, and the messages about the rest."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.modeling.library.entries import LibraryError
from palpate.modeling.library.terms import vocabulary
from palpate.modeling.library.wishes import combined, wishes_in
from tests.modeling.library.library_for_tests import PAIRS

KNOWN = vocabulary(PAIRS, ("wood", "foam"))
ROUGH, BUMPY, STICKY, SOFT = range(4)


def degree_of(text):
    """By attribute, the values that fit at least by half."""
    return [(pair, soft.half_fit) for pair, soft in combined(wishes_in([text], KNOWN))]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("rough", [(ROUGH, (0, 37.5))]),
        ("Rough!", None),
        ("smooth", [(ROUGH, (62.5, 100))]),
        ("very smooth", [(ROUGH, (77.5, 100))]),
        ("very, smooth", None),
        ("really smooth", [(ROUGH, (77.5, 100))]),
        ("extremely hard", [(SOFT, (0, 10))]),
        ("very very hard", [(SOFT, (0, 10))]),
        ("quite soft", [(SOFT, (55, 85))]),
        ("a bit sticky", [(STICKY, (25, 50))]),
        ("A LITTLE BIT sticky", [(STICKY, (25, 50))]),
        ("somewhat grippy", [(STICKY, (25, 50))]),
        ("not bumpy", [(BUMPY, (0, 62.5))]),
        ("isn’t bumpy", [(BUMPY, (0, 62.5))]),
        ("not very bumpy", [(BUMPY, (0, 77.5))]),
        ("not too bumpy", [(BUMPY, (0, 77.5))]),
        ("not at all bumpy", [(BUMPY, (0, 27.5))]),
        ("not a bit bumpy", [(BUMPY, (0, 27.5))]),
        ("not bumpy at all", [(BUMPY, (0, 27.5))]),
        ("no bumps at all, soft", [(BUMPY, (0, 27.5)), (SOFT, (62.5, 100))]),
        ("smooth very", [(ROUGH, (77.5, 100))]),
        ("sticky a bit, not bumpy", [(BUMPY, (0, 62.5)), (STICKY, (25, 50))]),
        ("rough very sticky", [(ROUGH, (0, 37.5)), (STICKY, (0, 22.5))]),
        ("neither very rough nor a bit bumpy", [(ROUGH, (22.5, 100)), (BUMPY, (0, 27.5))]),
        ("neither rough nor bumpy at all", [(ROUGH, (37.5, 100)), (BUMPY, (0, 27.5))]),
        ("medium rough", [(ROUGH, (37.5, 62.5))]),
        ("medium rough-smooth", [(ROUGH, (37.5, 62.5))]),
        ("between rough and smooth", [(ROUGH, (37.5, 62.5))]),
        ("neither rough nor smooth", [(ROUGH, (37.5, 62.5))]),
        ("neither rough nor sticky", [(ROUGH, (37.5, 100)), (STICKY, (37.5, 100))]),
        ("not rough nor sticky", [(ROUGH, (37.5, 100)), (STICKY, (37.5, 100))]),
        ("smooth 80", [(ROUGH, (70, 90))]),
        ("80 smooth", [(ROUGH, (70, 90))]),
        ("Smooth=80", [(ROUGH, (70, 90))]),
        ("smooth about 80 %", [(ROUGH, (70, 90))]),
        ("rough 80", [(ROUGH, (10, 30))]),
        ("Rough-Smooth=20", [(ROUGH, (10, 30))]),
        ("smooth 100", [(ROUGH, (90, 100))]),
        ("soft 60-80", [(SOFT, (55, 85))]),
        ("soft between 60 and 80", [(SOFT, (55, 85))]),
        ("soft from 60 to 80", [(SOFT, (55, 85))]),
        ("soft 60 and 80 smooth", [(ROUGH, (70, 90)), (SOFT, (50, 70))]),
        ("80 smooth and soft 60", [(ROUGH, (70, 90)), (SOFT, (50, 70))]),
        ("soft between 60 and 80 and smooth", [(ROUGH, (62.5, 100)), (SOFT, (55, 85))]),
        ("soft at least 60", [(SOFT, (55, 100))]),
        ("soft >= 60", [(SOFT, (55, 100))]),
        ("hard at least 60", [(SOFT, (0, 45))]),
        ("up to 30 soft", [(SOFT, (0, 35))]),
        ("it should feel rough and a bit sticky but not bumpy",
         [(ROUGH, (0, 37.5)), (BUMPY, (0, 62.5)), (STICKY, (25, 50))]),
        ("squishy; coarse, no bumps", [(ROUGH, (0, 37.5)), (BUMPY, (0, 62.5)), (SOFT, (62.5, 100))]),
        ("roughness 80, softness 20", [(ROUGH, (10, 30)), (SOFT, (10, 30))]),
    ],
)  # fmt: skip
def test_words_mean_these_values(text, expected):
    if expected is None:
        with pytest.raises(LibraryError):
            degree_of(text)
    else:
        assert degree_of(text) == expected


def test_a_wish_keeps_the_words_of_its_request():
    assert [wish.text for wish in wishes_in(["rough, a bit sticky", "Soft=20-40"], KNOWN)] == [
        "rough", "a bit sticky", "soft = 20 - 40",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ruogh", "'ruogh' is not known. Did you mean 'rough'?"),
        ("xyzzy", "Words: rough (coarse"),
        ("very", "a word is missing at the end"),
        ("very, rough", "a word is missing before ','"),
        ("wood", "--class wood"),
        ("warm and soft", "these textures are not known as warm or not, only by Rough-Smooth"),
        ("chilly", "not known as cold"),
        ("rough or bumpy", "search once for each"),
        ("not fairly rough", "'not fairly'"),
        ("quite hard 70", "give one of them"),
        ("smooth 120", "120 is not on the scale, 0 to 100"),
        ("rough -5", "-5 is not on the scale, 0 to 100"),
        ("Rough=-5", "-5 is not on the scale, 0 to 100"),
        ("−5 rough", "-5 is not on the scale, 0 to 100"),
        ("soft at least -5", "-5 is not on the scale, 0 to 100"),
        ("soft between -5 and 20", "-5 is not on the scale, 0 to 100"),
        ("soft 20 to -5", "-5 is not on the scale, 0 to 100"),
        ("soft 80-60", "from the lesser number to the greater"),
        ("Hard-Soft", "a number is expected after it, 0 for hard to 100 for soft"),
        ("very hard-soft", "names the attribute"),
        ("neither bumpy", "'neither' is followed by"),
        ("between rough and sticky", "the two ends of one attribute"),
        ("between 20 and 40 rough", "'rough between 20 and 40'"),
        ("", "nothing is wished for"),
        (" , and ", "nothing is wished for"),
        ("rough ☃", "'☃' is not known"),
        ("rough at all", "'at all' goes with 'not': 'not rough at all'"),
        ("rough not", "a word is missing at the end"),
        ("neither fairly rough nor soft", "what is meant by 'not fairly'"),
        ("soft 60 and 80", "a number has no word next to it. Write a range as 'soft 60-80'"),
        ("rougher", "'rougher' compares, and 'find' takes how a texture feels by itself: say 'rough' or 'very rough'"),
        ("flatter, bumpier", "say 'flat' or 'very flat'"),
        ("a bit stickier than T17", "palpate textures nearest ID"),
        ("the coarsest", "say 'coarse' or 'extremely coarse'"),
        ("more slippery", "'more slippery' compares, and 'find' takes how a texture feels by itself: say 'very sli"),
        ("less soft", "say 'not very soft'"),
        ("like T17", "palpate textures nearest ID"),
    ],
)
def test_what_is_not_understood_is_reported_with_what_would_be(text, message):
    with pytest.raises(LibraryError) as error:
        wishes_in([text], KNOWN)
    assert message in str(error.value)


def test_a_word_that_was_nearly_right_is_reported_without_the_list_of_all():
    with pytest.raises(LibraryError) as error:
        wishes_in(["ruogh"], KNOWN)
    assert str(error.value) == "'ruogh' is not known. Did you mean 'rough'?"


def test_the_middle_of_one_attribute_is_one_wish():
    (wish,) = wishes_in(["neither rough nor smooth"], KNOWN)
    assert (wish.text, wish.soft.half_fit) == ("neither rough nor smooth", (37.5, 62.5))


def test_a_word_that_is_known_is_not_offered_in_its_own_stead():
    with pytest.raises(LibraryError) as error:
        wishes_in(["between very rough and smooth"], KNOWN)
    assert "'very' cannot stand there" in str(error.value) and "mean 'very'" not in str(error.value)


@pytest.mark.parametrize(
    "text", ["rough and smooth", "very rough, a bit rough", "smooth 80, rough", "soft 20, soft 60", "rough, not rough"]
)
def test_wishes_that_no_value_meets_are_distinguished(text):
    with pytest.raises(LibraryError, match="contradict each other: they are about one attribute"):
        wishes_in([text], KNOWN)


@pytest.mark.parametrize(
    "text", ["rough, very rough", "not rough, not smooth", "rough, rough", "fairly rough, very rough"]
)
def test_wishes_that_a_value_meets_are_not(text):
    assert len(wishes_in([text], KNOWN)) == 2


@given(st.permutations(["rough", "a bit sticky", "not bumpy", "soft 60-80", "not very rough"]))
def test_the_order_of_wishes_does_not_matter(texts):
    ordered = combined(wishes_in(["rough, a bit sticky, not bumpy, soft 60-80, not very rough"], KNOWN))
    assert combined(wishes_in([", ".join(texts)], KNOWN)) == ordered
    assert combined(wishes_in(texts, KNOWN)) == ordered


@given(st.text(max_size=40))
def test_any_text_is_understood_or_refused_by_name(text):
    try:
        assert wishes_in([text], KNOWN)
    except LibraryError as error:
        assert str(error)

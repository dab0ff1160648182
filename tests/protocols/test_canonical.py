import json
import math
from enum import IntEnum

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.protocols.canonical import NotCanonical, canonical, difference, digest, parse


class Whole(IntEnum):
    """Numbers that json writes, and that a reader gets back as another type."""

    ONE = 1


texts = st.text(st.characters(codec="utf-8"), max_size=20)
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | texts,
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(texts, inner, max_size=5),
    max_leaves=30,
)


def test_the_text_is_fixed_to_the_byte():
    value = {"b": [1, 1.0, -0.0, 1e300, True, None], "a": "é\n\u2028", "": (2,)}
    expected = '{"":[2],"a":"é\\n\u2028","b":[1,1.0,-0.0,1e+300,true,null]}'
    assert canonical(value) == expected.encode()
    assert digest({"a": 1}) == "015abd7f5cc57a2dd94b7590f04ad8084273905ee33ec5cebeae62276a97f862"


@given(values)
def test_text_and_value_go_round(value):
    text = canonical(value)
    assert canonical(parse(text)) == text
    assert json.loads(text) == json.loads(json.dumps(value))


@given(st.dictionaries(texts, values, max_size=6), st.randoms())
def test_the_order_of_keys_does_not_matter(value, random):
    keys = list(value)
    random.shuffle(keys)
    assert canonical({key: value[key] for key in keys}) == canonical(value)


@pytest.mark.parametrize(
    ("value", "why"),
    [
        ({"a": [1, math.nan]}, r"\$\.a\[1\]: nan is not a finite number"),
        (math.inf, "inf is not a finite number"),
        ({1: 2}, "the key 1 is not text"),
        ({"a": {3}}, r"\$\.a: set .* has no JSON form"),
        ({"a": [{"b": Whole.ONE}]}, r"\$\.a\[0\]\.b: Whole .* has no JSON form"),
        ("\ud800", "half a character"),
    ],
)
def test_what_has_no_canonical_text_is_refused_by_place(value, why):
    with pytest.raises(NotCanonical, match=why):
        canonical(value)


@pytest.mark.parametrize("text", [b'{"a":NaN}', b"[Infinity]", b'{"a":1,"a":2}'])
def test_texts_that_are_not_canonical_json_are_refused(text):
    with pytest.raises(NotCanonical):
        parse(text)


@given(values, values)
def test_a_difference_is_found_exactly_where_texts_differ(one, other):
    assert (difference(one, other) is None) == (canonical(one) == canonical(other))


@pytest.mark.parametrize(
    ("recorded", "now", "message"),
    [
        ({"a": [1, 2]}, {"a": [1, 3]}, "$.a[1]: recorded 2, now 3"),
        ({"a": 1}, {}, "$.a: recorded 1, now missing"),
        ({}, {"a": 1}, "$.a: not recorded, now 1"),
        ([1], [1, 2], "$: recorded 1 items, now 2"),
        (1, 1.0, "$: recorded 1, now 1.0"),
        ("x" * 100, "y", f'$: recorded "{"x" * 76}..., now "y"'),
    ],
)
def test_a_difference_says_where_and_how(recorded, now, message):
    assert difference(recorded, now) == message

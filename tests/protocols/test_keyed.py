import math
import statistics

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.protocols.keyed import keyed_bits, normal, shuffled, uniform


def test_draws_are_the_same_on_every_machine():
    assert keyed_bits("a", 1) >> 192 == 0x135F17A475A61AFD
    assert uniform("a", 1) == 0.07566974415899386
    assert shuffled("ABCDE", "key") == ("C", "D", "A", "E", "B")


@given(st.lists(st.text(max_size=5), unique=True, max_size=20), st.randoms(), st.integers())
def test_a_shuffle_does_not_depend_on_the_order_it_is_given(items, random, key):
    again = list(items)
    random.shuffle(again)
    assert shuffled(again, key) == shuffled(items, key)
    assert sorted(shuffled(items, key)) == sorted(items)


def test_draws_are_uniform_and_normal():
    draws = [uniform("u", i) for i in range(4000)]
    assert 0 < min(draws) < 0.005 and 0.995 < max(draws) < 1
    assert statistics.fmean(draws) == pytest.approx(0.5, abs=4 * math.sqrt(1 / 12 / 4000))
    normals = [normal("n", i) for i in range(4000)]
    assert statistics.fmean(normals) == pytest.approx(0, abs=4 / math.sqrt(4000))
    assert statistics.stdev(normals) == pytest.approx(1, abs=0.05)


def test_the_key_alone_decides():
    assert uniform("a", 1) != uniform("a", 2) != uniform("a", None)
    assert uniform("a", "1") != uniform("a", 1)

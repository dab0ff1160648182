"""Nothing of a test is in its training, and every door and variant is in every fold as evenly as can be."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.modeling.doors.data import SAME_N
from palpate.modeling.doors.folding import Fold, folds, held_share
from palpate.modeling.doors.training_variants import with_variants
from palpate.modeling.evaluate.rows import ModelDataError
from tests.examples import examples
from tests.modeling.doors.data_for_tests import crossed, random_doors

PAIRS = tuple((15 * door, 15 * door + 10) for door in range(6))
"""g0 and g10 of each door, as in the study: one profile."""


def counted(data, fold, labels):
    return Counter(getattr(data, labels)[row] for row in fold.test)


@pytest.mark.parametrize("seed", [0, 7])
def test_the_studys_90_stimuli_give_five_folds_of_three_variants_of_each_door(seed):
    data = crossed(6, 15, same=PAIRS)
    divided = folds(data, seed=seed)
    assert [fold.name for fold in divided] == [f"fold {n}" for n in range(1, 6)]
    for fold in divided:
        assert counted(data, fold, "doors") == {f"D{n}": 3 for n in range(6)}
        assert set(counted(data, fold, "variants").values()) <= {1, 2}
        assert len(counted(data, fold, "variants")) == 15
        assert {row + 10 in fold.test for row in fold.test if data.variants[row] == "g0"} <= {True}


def test_each_row_is_tested_once_and_every_other_one_is_trained_on():
    data = crossed(6, 15, same=PAIRS)
    divided = folds(data)
    assert sorted(np.concatenate([fold.test for fold in divided]).tolist()) == list(range(90))
    for fold in divided:
        assert sorted([*fold.train.tolist(), *fold.test.tolist()]) == list(range(90))


@st.composite
def any_data(draw):
    """Any doors and variants, unbalanced; some profiles equal, some declared to be of one source."""
    count = draw(st.integers(6, 24))
    places = draw(st.lists(st.tuples(st.sampled_from("ABCD"), st.sampled_from("wxyz")), min_size=count, max_size=count))
    data = random_doors(places, seed=draw(st.integers(0, 5)))
    alike = draw(st.lists(st.tuples(st.integers(0, count - 1), st.integers(0, count - 1)), max_size=4))
    force, source = data.force_N.copy(), list(data.source)
    for nth, (one, other) in enumerate(alike):
        if nth % 2:
            source[other] = source[one]
        else:
            force[other] = force[one] + draw(st.sampled_from([0.0, 0.9 * SAME_N]))
    return replace(data, force_N=force, source=tuple(source))


def leaks(data, fold):
    """Pairs of a training and a test row that are of one source or (nearly) one profile."""
    return [
        (a, b) for a in fold.train for b in fold.test
        if data.source[a] == data.source[b] or np.abs(data.force_N[a] - data.force_N[b]).max() <= SAME_N
    ]  # fmt: skip


@settings(max_examples=examples(40), deadline=None)
@given(any_data(), st.integers(2, 4), st.integers(0, 3), st.booleans())
def test_no_source_and_no_profile_is_ever_on_both_sides(data, k, seed, by_door):
    try:
        divided = folds(data, k, "leave_one_door_out" if by_door else "grouped", seed)
    except ModelDataError as refusal:
        assert "source" in str(refusal)
        return
    for fold in divided:
        assert len(fold.test) and not set(fold.test) & set(fold.train)
        assert not leaks(data, fold)
    tested = sorted(np.concatenate([fold.test for fold in divided]).tolist())
    assert tested == list(range(len(data)))


@settings(max_examples=examples(20), deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from("ABCD"), st.sampled_from("vwxyz")), min_size=8, max_size=30), st.integers(2, 5)
)
def test_where_every_profile_is_its_own_source_the_balance_is_perfect(places, k):
    """A bipartite multigraph always has an equitable colouring (de Werra 1971), so the best is known: it is reached."""
    data = random_doors(places)
    divided = folds(data, k)
    for labels in ("doors", "variants"):
        for name, total in Counter(getattr(data, labels)).items():
            assert {counted(data, fold, labels)[name] for fold in divided} <= {total // k, -(-total // k)}
    assert {len(fold.test) for fold in divided} <= {len(places) // k, -(-len(places) // k)}


@settings(max_examples=examples(20), deadline=None)
@given(any_data(), st.sampled_from([0.1, 0.15, 0.3, 0.5]), st.integers(0, 3))
def test_a_held_share_has_no_source_in_common_with_the_rest(data, share, seed):
    try:
        rest, held = held_share(data, share, seed)
    except ModelDataError as refusal:
        assert "source" in str(refusal)
        return
    assert sorted([*rest.tolist(), *held.tolist()]) == list(range(len(data)))
    assert not leaks(data, Fold("held", rest, held))


def test_a_held_share_of_a_training_side_is_about_the_requested_one_and_balanced():
    data = crossed(6, 15, same=PAIRS)
    side = data.rows(folds(data)[0].train)
    rest, held = held_share(side, 0.15)
    assert (len(rest), len(held)) in [(61, 11), (62, 10)]
    assert set(Counter(side.doors[row] for row in held).values()) <= {1, 2}
    assert max(Counter(side.variants[row] for row in held).values()) == 1


def test_the_order_of_the_rows_does_not_matter_and_the_seed_does():
    data = crossed(3, 6, same=[(0, 4)])
    order = np.random.default_rng(3).permutation(len(data))
    named = [{data.ids[row] for row in fold.test} for fold in folds(data, 3, seed=5)]
    turned = data.rows(order)
    assert [{turned.ids[row] for row in fold.test} for fold in folds(turned, 3, seed=5)] == named
    assert [{data.ids[row] for row in fold.test} for fold in folds(data, 3, seed=6)] != named


def test_leave_one_door_out_tests_each_door_and_leaves_its_doubles_at_other_doors_out():
    data = crossed(3, 4, same=[(0, 5)])  # D0_g0 and D1_g1
    divided = folds(data, kind="leave_one_door_out")
    assert [fold.name for fold in divided] == ["D0", "D1", "D2"]
    assert [(fold.train.tolist(), fold.test.tolist()) for fold in divided] == [
        ([4, 6, 7, 8, 9, 10, 11], [0, 1, 2, 3]),
        ([1, 2, 3, 8, 9, 10, 11], [4, 5, 6, 7]),
        ([0, 1, 2, 3, 4, 5, 6, 7], [8, 9, 10, 11]),
    ]


def test_training_variants_stay_with_their_stimulus_unless_the_split_is_leaky():
    data = with_variants(crossed(2, 5), seed=1)
    for fold in folds(data, 5):
        assert not {data.source[row] for row in fold.train} & {data.source[row] for row in fold.test}
        assert len(fold.test) == 12
    leaky = folds(data, 5, "leaky")
    assert all({data.source[row] for row in fold.train} & {data.source[row] for row in fold.test} for fold in leaky)
    assert all(counted(data, fold, "doors") == {"D0": 6, "D1": 6} for fold in leaky)


@pytest.mark.parametrize(
    ("data", "how", "says"),
    [
        (crossed(2, 3), {"k": 1}, "1 fold: at least 2"),
        (crossed(2, 3), {"k": 0}, "0 folds"),
        (crossed(2, 3), {"k": 7}, "6 sources cannot be dealt into 7 parts"),
        (crossed(1, 2), {"k": 2}, "grouped, fold 1: 1 source would be left to train on; at least 2"),
        (crossed(1, 3), {"kind": "leave_one_door_out"}, "D0: 0 sources would be left"),
        (crossed(2, 3), {"kind": "leeky"}, "did you mean 'leaky'"),
    ],
)
def test_a_split_that_leaves_too_little_is_refused(data, how, says):
    with pytest.raises(ModelDataError, match=says):
        folds(data, **how)


@pytest.mark.parametrize("share", [0.0, 1.0, -1.0, float("nan")])
def test_a_share_that_is_none_is_refused(share):
    with pytest.raises(ModelDataError, match="between 0 and 1"):
        held_share(crossed(2, 3), share)


def test_of_two_sources_none_can_be_held_back():
    with pytest.raises(ModelDataError, match="2 sources: none can be held back; at least 3"):
        held_share(crossed(1, 2))

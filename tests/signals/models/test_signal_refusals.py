"""A step that does not fit is refused by name, before the model runs."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.signals.models.card import Clip, Dense, Port, Residual
from palpate.signals.models.card_steps import (
    Add,
    Attention,
    Cartesian,
    Join,
    Keep,
    Lstm,
    Norm,
    Part,
    Polar,
    Recall,
    Turn,
)
from palpate.signals.models.errors import ModelFileError
from tests.signals.models.cards import port
from tests.signals.models.test_signal_steps import ATTEND, ATTENTION, CHANNELS, SIZE, START, model_of

EVEN = {"w": np.ones((8, CHANNELS)), "s": np.ones((8, 2)), "b": np.ones(8)}


@pytest.mark.parametrize(
    ("steps", "tensors", "words"),
    [
        ([Recall(kept="x")], {}, r"step 1 \(recall\): no step before it has stored 'x'"),
        ([Add(kept="x"), Keep(kept="x")], {}, r"step 1 \(add\): no step before"),
        ([Join(kept=("x",))], {}, "no step before"),
        ([Residual(steps=(Recall(kept="x"),))], {}, r"step 1 \(residual\), step 1 \(recall\): no step before"),
        ([Keep(kept="w"), Dense(weight="w", bias="b")], {"w": np.ones((1, SIZE)), "b": np.ones(1)}, "name of a tensor"),
        ([Keep(kept="x"), *START, Add(kept="x")], {}, r"step 3 \(add\): shape \(6, 5\) comes to it and 'x' has"),
        ([Keep(kept="x"), *START, Join(kept=("x",))], {}, "do not fit together"),
        ([*START, Keep(kept="x"), Turn(), Join(kept=("x",))], {}, "do not fit together"),
        ([Part(start=3, stop=3)], {}, "3 to before 3 of 30 channels is no part"),
        ([Part(start=0, stop=31)], {}, "is no part"),
        ([Part(start=0, stop=3, along="length")], {}, r"step 1 \(part\): shape \(30,\) comes to it"),
        ([*START, Part(start=0, stop=6, along="length")], {}, "0 to before 6 of 5 length is no part"),
        ([Turn()], {}, r"step 1 \(turn\): shape \(30,\) comes to it"),
        ([*START, Polar()], {}, r"\(2, length\) is expected, real and imaginary parts"),
        ([*START, Cartesian()], {}, r"\(2, length\) is expected, magnitudes and phases"),
        ([*START, Norm(weight="n", bias="m")], {"n": np.ones(5), "m": np.ones(6)}, r"'n' has shape \(5,\); \(6\)"),
        ([*START, Attention(**ATTEND, heads=4)], ATTENTION, "4 heads do not share 6 channels evenly"),
        ([*START, Turn(), Attention(**ATTEND, heads=1)], ATTENTION, r"'w' has shape \(18, 6\); \(15, 5\) is expected"),
        ([*START, Attention(**ATTEND, heads=1, memory="x")], ATTENTION, "no step before it has stored 'x'"),
        ([*START, Keep(kept="x"), Part(start=0, stop=3), Attention(**ATTEND, heads=1, memory="x")], ATTENTION,
         r"'x' has shape \(6, 5\); \(3, any\) is expected"),
        ([*START, Keep(kept="x"), Part(start=0, stop=3, along="length"),
          Attention(**ATTEND, heads=1, memory="x", causal=True)], ATTENTION, "causal over 3 places and 'x' has 5"),
        ([Lstm(weight="w", state="s", bias="b")], EVEN, r"shape \(30,\) comes to it"),
        ([*START, Lstm(weight="w", state="s", bias="b")], {**EVEN, "w": np.ones((7, 6))}, "has 7 rows; four gates"),
        ([*START, Lstm(weight="w", state="s", bias="b")], {**EVEN, "s": np.ones((8, 3))}, r"\(8, 2\) is expected"),
        ([Keep(kept="x"), *[Join(kept=("x", "x")), Keep(kept="x")] * 18], {}, "together"),
        ([Clip(low=0, high=1), Attention(**ATTEND, heads=1)], ATTENTION, r"step 2 \(attention\): shape \(30,\)"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_its_step(steps, tensors, words):
    with pytest.raises(ModelFileError, match=words):
        model_of(steps, tensors, Port(kind="texture_window", size=SIZE, unit=""), port(SIZE))

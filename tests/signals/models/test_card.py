"""A card says one thing for each number, and which arrays its steps use."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from palpate.signals.models.card import (
    Activation,
    Affine,
    Card,
    Dense,
    DoorFeatures,
    Forest,
    Interval,
    Mean,
    Port,
    Residual,
    Weights,
    tensors_named,
)

PORT = {"kind": "ratings", "size": 2, "unit": "0..100"}
CARD = {"name": "m", "title": "t", "method": "x", "weights": {"file": "m.safetensors", "sha256": "0" * 64, "bytes": 1}}


def test_every_array_of_nested_steps_is_named_in_order():
    dense = Dense(weight="w", bias="b")
    forest = Forest(roots="r", feature="f", threshold="t", left="l", right="g", value="v")
    steps = (
        Affine(gain="a", offset=1.0), DoorFeatures(names=("max_force_N",)), Activation(function="relu"),
        Residual(steps=(Residual(steps=(dense,)),)), Mean(members=((forest,), (Affine(offset="o"),))),
    )  # fmt: skip
    assert list(tensors_named(steps)) == ["a", "w", "b", "r", "f", "t", "l", "g", "v", "o"]


@pytest.mark.parametrize(
    "port_data",
    [
        {**PORT, "names": ("a",)},
        {**PORT, "names": ("a", "a")},
        {**PORT, "names": ("a", "b"), "antonyms": ("c",)},
        {**PORT, "antonyms": ("c", "d")},
        {**PORT, "scale": (1.0, 1.0)},
        {**PORT, "scale": (0.0, float("nan"))},
        {**PORT, "within": (1.0, 1.0)},
        {**PORT, "within": (0.0, float("inf"))},
        {**PORT, "size": 0},
        {**PORT, "kind": "sound"},
    ],
)
def test_a_port_that_contradicts_itself_is_refused(port_data):
    with pytest.raises(ValidationError):
        Port.model_validate(port_data)


def test_an_interval_has_a_half_width_for_each_output():
    good = Interval(method="x", coverage=0.9, half_width=(1.0, 0.0))
    assert Card(**CARD, takes=PORT, gives=PORT, steps=(), interval=good).interval == good
    for wrong in ((1.0,), (1.0, -1.0)):
        with pytest.raises(ValidationError):
            Card(**CARD, takes=PORT, gives=PORT, steps=(), interval={**good.model_dump(), "half_width": wrong})


def test_a_card_survives_its_own_text():
    card = Card(**CARD, takes=PORT, gives=PORT, steps=(Residual(steps=(Affine(gain=2, offset="o"),)),))
    assert Card.model_validate_json(card.model_dump_json(), strict=True) == card
    assert isinstance(card.weights, Weights)

"""Compile a card's steps to a flat program of the kernel, with optimisations that do not change the answer.

Normalisation of the input is done once, in double precision, as the numbers are read; a spectrum is one product with
the input; 1 / sqrt(depth) is in the queries' weights; additions and scales after a product are part of the product; a
projection of a projection from few channels is one product (the first attention of an embedded signal); copies,
transpositions and joins of views are avoided.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models import card as steps_of
from palpate.signals.models import card_steps as signals_of
from palpate.signals.models.card import Affine, Card, Conv, Dense, Mean, Residual, Step
from palpate.signals.models.native import plain_steps, product_steps, signal_steps
from palpate.signals.models.native.draft import Draft, Finished, finished
from palpate.signals.models.native.library import InstructionSet
from palpate.signals.models.native.plain_steps import Tensors
from palpate.signals.models.native.shapes import is_list, settled, spread
from palpate.signals.models.native.values import Linear, NotCompiled, Value

LOOK_AHEAD = 4
"""Number of steps that are searched for the one that reads a product as a spectrum."""
MOST_FORMULA = 512
"""Greatest number of values of a spectrum."""
MOST_INPUTS = 1024
"""Greatest number of inputs of a formula; the widest input here is a force profile, of 621."""
Handler = Callable[[Any, Value, Draft, Tensors], Value]


@dataclass(frozen=True)
class Compiled:
    """A program, and how its output becomes the model's answer: gain * value + offset, in double precision."""

    numbers: Finished
    answer: int
    answer64: int
    out_gain: Array
    out_offset: Array


def compiled(card: Card, tensors: Tensors, instructions: InstructionSet) -> Compiled:
    """Return the program of a model whose steps `palpate.signals.models.runtime` has checked.

    Raises NotCompiled for a step that the kernel does not support.
    """
    draft, size = Draft(instructions), card.takes.size
    if size > MOST_INPUTS:
        raise NotCompiled(f"an input of {size} numbers; at most {MOST_INPUTS} are read")
    value = Value((size,), linear=Linear(np.eye(size), np.zeros(size)))
    last = card.steps[-1] if card.steps else None
    steps = card.steps[:-1] if isinstance(last, Affine) else card.steps
    value = settled(draft, _chain(steps, value, draft, tensors))
    gain, offset = np.ones(value.size), np.zeros(value.size)
    if isinstance(last, Affine):
        gain, offset = (
            np.array(spread(np.asarray(tensors[given] if isinstance(given, str) else given, np.float64), value)[0])
            for given in (last.gain, last.offset)
        )
    if not is_list(value):
        raise NotCompiled("an answer that is not a list")
    numbers = finished(draft, value.spot)
    return Compiled(numbers, value.spot.room.start + value.spot.past, value.wide, gain, offset)


def _chain(steps: Sequence[Step], value: Value, draft: Draft, tensors: Tensors) -> Value:
    for place, step in enumerate(steps):
        linear = value.linear
        if linear is not None and _to_spectrum(steps[place : place + LOOK_AHEAD], value):
            if isinstance(step, Dense):
                value = product_steps.dense_formula(step, linear, tensors)
            elif not isinstance(step, Conv) or tensors[step.weight].shape[2] != 1:
                raise NotCompiled("a spectrum by a convolution wider than 1")
            else:
                value = product_steps.conv_formula(step, value, linear, tensors)
        else:
            value = _next(step, value, draft, tensors)
    return value


def _to_spectrum(steps: Sequence[Step], value: Value) -> bool:
    """Return whether this step is a product whose outputs will be read as real and imaginary parts."""
    first, between = steps[0], (signals_of.Turn, steps_of.Reshape, Affine)
    if not isinstance(first, Dense) and not (isinstance(first, Conv) and not first.pad and len(value.shape) == 2):
        return False
    after = next((step for step in steps[1:] if not isinstance(step, between)), None)
    return isinstance(after, signals_of.Polar) and value.size <= MOST_FORMULA


def _next(step: Step, value: Value, draft: Draft, tensors: Tensors) -> Value:
    if isinstance(step, Residual):
        value = replace(settled(draft, value), free=False)
        inner = settled(draft, _chain(step.steps, value, draft, tensors))
        return plain_steps.added(inner, value, draft, True)
    if isinstance(step, Mean):
        given = replace(value, free=False)
        total = settled(draft, _chain(step.members[0], given, draft, tensors))
        for member in step.members[1:]:
            total = plain_steps.added(settled(draft, _chain(member, given, draft, tensors)), total, draft, False)
        return plain_steps.affine(Affine(gain=1 / len(step.members)), total, draft, tensors)
    if (handler := _HANDLERS.get(type(step))) is None:
        raise NotCompiled(f"the step {step.do}")
    return handler(step, value, draft, tensors)


_HANDLERS: Mapping[type, Handler] = {
    steps_of.Affine: plain_steps.affine,
    steps_of.Activation: plain_steps.activation,
    steps_of.Clip: plain_steps.clip,
    steps_of.MaxPool: plain_steps.max_pool,
    steps_of.Upsample: plain_steps.upsample,
    steps_of.Reshape: plain_steps.reshape,
    steps_of.Dense: product_steps.dense,
    steps_of.Conv: product_steps.conv,
    signals_of.Keep: plain_steps.keep,
    signals_of.Recall: plain_steps.recall,
    signals_of.Add: plain_steps.add,
    signals_of.Join: plain_steps.join,
    signals_of.Part: plain_steps.part,
    signals_of.Turn: plain_steps.turn,
    signals_of.Attention: product_steps.attention,
    signals_of.Lstm: product_steps.lstm,
    signals_of.Norm: signal_steps.norm,
    signals_of.Polar: signal_steps.polar,
    signals_of.Cartesian: signal_steps.cartesian,
    signals_of.Autoregression: signal_steps.autoregression,
}

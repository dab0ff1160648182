"""From a card's steps to something that runs: every shape is followed and checked once, before anything is asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from devices.models import layers, look_ups, profile_steps
from devices.models.form import LARGEST, At, Built, Form, Run, Values
from protocols import model_card as steps_of
from protocols.model_card import Dense, Mean, Residual, Step, Upsample

__all__ = ["Form", "Run", "built"]


def built(steps: Sequence[Step], tensors: Mapping[str, Values], form: Form) -> Built:
    """What these steps do to (n, *form.shape), and the form that comes out. Raises ModelFileError naming the step."""
    return _chain(steps, form, At("", tensors))


def _chain(steps: Sequence[Step], form: Form, at: At) -> Built:
    runs: list[Run] = []
    place = 0
    while place < len(steps):
        together = 2 if _copies_before_dense(steps[place : place + 2]) else 1
        kinds = ", ".join(step.do for step in steps[place : place + together])
        here = at.inner(f"step {place + 1} ({kinds})")
        run, form = _next(steps[place : place + together], form, here)
        if form.size > LARGEST:
            raise here.refuse(f"{form.size} numbers for one input; at most {LARGEST} are run")
        runs.append(run)
        place += together
    return _one_after_another(tuple(runs)), form


def _copies_before_dense(steps: Sequence[Step]) -> bool:
    """Copies need not be made where a dense layer can count them in its weights."""
    return len(steps) == 2 and isinstance(steps[0], Upsample) and isinstance(steps[1], Dense)


def _next(steps: Sequence[Step], form: Form, at: At) -> Built:
    """One step at work, or an upsampling and a dense one together."""
    first, last = steps[0], steps[-1]
    if isinstance(first, Upsample) and isinstance(last, Dense):
        layers.require_sides(first, form, at)
        return layers.dense(last, form, at, times=first.times)
    make: Callable[[Any, Form, At], Built] = _BUILDERS[type(first)]
    return make(first, form, at)


def _one_after_another(runs: tuple[Run, ...]) -> Run:
    def run(x: Values) -> Values:
        for each in runs:
            x = each(x)
        return x

    return run


def _residual(step: Residual, form: Form, at: At) -> Built:
    inner, out = _chain(step.steps, replace(form, owned=False), at)
    if out.shape != form.shape:
        raise at.refuse(f"its steps turn shape {form.shape} into {out.shape}; the same shape is expected")

    def run(x: Values) -> Values:
        y = inner(x)
        if out.length_first != form.length_first:
            y = y.swapaxes(1, 2)
        total = np.add(y, x, out=y) if out.owned and y.dtype == np.result_type(x, y) else y + x
        return np.asarray(np.maximum(total, 0, out=total))

    return run, replace(form, owned=True)


def _mean(step: Mean, form: Form, at: At) -> Built:
    if not step.members:
        raise at.refuse("it has no members; at least one is expected")
    members = []
    for number, steps in enumerate(step.members, start=1):
        run, out = _chain(steps, replace(form, owned=False), at.inner(f"member {number}"))
        members.append((run, out))
    shapes = {out.shape for _, out in members}
    if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
        raise at.refuse(f"its members give shapes {sorted(shapes)}; one and the same list of numbers is expected")

    def mean(x: Values) -> Values:
        return np.asarray(sum(run(x).astype(np.float64) for run, _ in members) / len(members))

    return mean, Form(shapes.pop(), owned=True)


_BUILDERS: Mapping[type, Callable[[Any, Form, At], Built]] = {
    steps_of.Affine: layers.affine,
    steps_of.Dense: layers.dense,
    steps_of.Conv: layers.conv,
    steps_of.Activation: layers.activation,
    steps_of.MaxPool: layers.max_pool,
    steps_of.Upsample: layers.upsample,
    steps_of.Reshape: layers.reshape,
    steps_of.Clip: layers.clip,
    steps_of.Kernel: look_ups.kernel,
    steps_of.Forest: look_ups.forest,
    steps_of.Nearest: look_ups.nearest,
    steps_of.DoorFeatures: profile_steps.door_features,
    steps_of.Playable: profile_steps.playable,
    steps_of.Residual: _residual,
    steps_of.Mean: _mean,
}

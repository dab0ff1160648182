"""Build a function from a card's steps: every shape is computed and checked once, before the first input."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.signals.doors.grid import POINTS, DoorDataError
from palpate.signals.models import activations, layers, sequence_layers, value_steps
from palpate.signals.models import card as steps_of
from palpate.signals.models import card_steps as signal_steps
from palpate.signals.models.card import Conv, Dense, DoorFeatures, Mean, Playable, Residual, Step, Upsample
from palpate.signals.models.card_steps import Attention, Norm
from palpate.signals.models.errors import ModelFileError, ModelInputError
from palpate.signals.models.form import LARGEST, At, Built, Form, KeptValues, Run, Values

__all__ = ["Form", "Run", "built"]


def built(steps: Sequence[Step], tensors: Mapping[str, Values], form: Form) -> Built:
    """Return a function that runs these steps on (n, *form.shape), and the form of its output.

    Raises ModelFileError that names the step.
    """
    if form.size > LARGEST:
        raise ModelFileError(f"{form.size} numbers for one input; at most {LARGEST} are run. Export the model again.")
    return _chain(steps, form, At("", tensors))


def _chain(steps: Sequence[Step], form: Form, at: At) -> Built:
    runs: list[Run] = []
    place = 0
    while place < len(steps):
        together = 2 if _one_step(steps[place : place + 2], at) else 1
        kinds = ", ".join(step.do for step in steps[place : place + together])
        here = at.inner(f"step {place + 1} ({kinds})")
        run, form = _next(steps[place : place + together], form, here)
        if form.size > LARGEST:
            raise here.refuse(f"{form.size} numbers for one input; at most {LARGEST} are run")
        runs.append(run)
        place += together

    def run_all(x: Values, kept: KeptValues) -> Values:
        for run in runs:
            x = run(x, kept)
        return x

    return run_all, form


def _one_step(steps: Sequence[Step], at: At) -> bool:
    """Return whether the second step can take over the first one's repetition or scaling of places in its weights."""
    if len(steps) < 2:
        return False
    first, second = steps
    if isinstance(first, Upsample):
        return isinstance(second, Dense)
    if not isinstance(first, Norm):
        return False
    if isinstance(second, Conv):  # it multiplies each place by a matrix, as attention does
        weight = at.tensors.get(second.weight)
        return not second.pad and weight is not None and weight.shape[2:] == (1,)
    return isinstance(second, Attention) and second.memory is None


def _next(steps: Sequence[Step], form: Form, at: At) -> Built:
    """Build one step, or two together."""
    first, last = steps[0], steps[-1]
    make: Callable[[Any, Form, At], Built] = _BUILDERS[type(last)]
    if isinstance(first, Upsample) and isinstance(last, Dense):
        layers.require_sides(first, form, at)
        return layers.dense(last, form, at, times=first.times)
    if isinstance(first, Norm) and isinstance(last, Attention | Conv):
        return sequence_layers.norm_before(first, last, make, form, at)
    return make(first, form, at)


def _residual(step: Residual, form: Form, at: At) -> Built:
    inner, out = _chain(step.steps, replace(form, owned=False), at)
    if out.shape != form.shape:
        raise at.refuse(f"its steps turn shape {form.shape} into {out.shape}; the same shape is expected")

    def run(x: Values, kept: KeptValues) -> Values:
        y = inner(x, kept)
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

    def mean(x: Values, kept: KeptValues) -> Values:
        return np.asarray(sum(run(x, kept).astype(np.float64) for run, _ in members) / len(members))

    return mean, Form(shapes.pop(), owned=True)


def door_features(step: DoorFeatures, form: Form, at: At) -> Built:
    """Build the engineered features that the card names. Raises ModelFileError for an unknown name."""
    from palpate.protocols.did_you_mean import nearest
    from palpate.signals.doors.model_features import FEATURES, features

    _require_profile(form, at)
    if unknown := [name for name in step.names if name not in FEATURES]:
        raise at.refuse(f"there is no feature {unknown[0]!r} here; {nearest(unknown[0], FEATURES)}")
    if not step.names:
        raise at.refuse("it names no features; at least one is expected")

    def run(x: Values, _kept: KeptValues) -> Values:
        try:
            return features(x, step.names)
        except DoorDataError as error:
            raise ModelInputError(str(error)) from None

    return run, Form((len(step.names),), owned=True)


def playable(step: Playable, form: Form, at: At) -> Built:
    """Build the limits on profiles."""
    from palpate.signals.doors.limits import bounded

    _require_profile(form, at)

    def run(x: Values, _kept: KeptValues) -> Values:
        rows = [bounded(row, step.force_N, step.slope_N_deg) for row in x.astype(np.float64, copy=False)]
        return np.where(np.isfinite(x), np.stack(rows), np.nan)

    return run, Form(form.shape, owned=True)


def _require_profile(form: Form, at: At) -> None:
    if form.shape != (POINTS,):
        raise at.refuse(f"shape {form.shape} comes to it; the {POINTS} forces of a profile are expected")


_BUILDERS: Mapping[type, Callable[[Any, Form, At], Built]] = {
    steps_of.Affine: layers.affine,
    steps_of.Dense: layers.dense,
    steps_of.Conv: layers.conv,
    steps_of.Activation: activations.activation,
    steps_of.MaxPool: layers.max_pool,
    steps_of.Upsample: layers.upsample,
    steps_of.Reshape: layers.reshape,
    steps_of.Clip: layers.clip,
    steps_of.Kernel: layers.kernel,
    steps_of.Forest: layers.forest,
    steps_of.Nearest: layers.nearest,
    steps_of.DoorFeatures: door_features,
    steps_of.Playable: playable,
    steps_of.Residual: _residual,
    steps_of.Mean: _mean,
    signal_steps.Keep: value_steps.keep,
    signal_steps.Recall: value_steps.recall,
    signal_steps.Add: value_steps.add,
    signal_steps.Join: value_steps.join,
    signal_steps.Part: value_steps.part,
    signal_steps.Turn: value_steps.turn,
    signal_steps.Polar: value_steps.polar,
    signal_steps.Cartesian: value_steps.cartesian,
    signal_steps.Norm: sequence_layers.norm,
    signal_steps.Attention: sequence_layers.attention,
    signal_steps.Lstm: sequence_layers.lstm,
    signal_steps.Autoregression: sequence_layers.autoregression,
}

"""Steps that keep a value for later, combine values, take parts of them, and transpose them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.signals.models.card_steps import Add, Cartesian, Join, Keep, Part, Polar, Recall, Turn
from palpate.signals.models.form import LARGEST, At, Built, Form, KeptValues, Values
from palpate.signals.models.layers import sides


def keep(step: Keep, form: Form, at: At) -> Built:
    """Build the step that keeps the value; nothing writes into it any more."""
    if step.kept in at.tensors:
        raise at.refuse(f"{step.kept!r} is the name of a tensor too; values are stored under their own names")
    lent = replace(form, owned=False)
    at.kept[step.kept] = lent

    def run(x: Values, kept: KeptValues) -> Values:
        kept[step.kept] = x
        return x

    return run, lent


def recall(step: Recall, form: Form, at: At) -> Built:  # noqa: ARG001 - what came before is left
    """Build the step that goes on with a kept value."""
    lent = at.form_of_kept(step.kept)

    def run(_x: Values, kept: KeptValues) -> Values:
        return kept[step.kept]

    return run, lent


def add(step: Add, form: Form, at: At) -> Built:
    """Build the addition of a kept value."""
    other = at.form_of_kept(step.kept)
    if other.shape != form.shape:
        raise at.refuse(f"shape {form.shape} comes to it and {step.kept!r} has {other.shape}; one shape is expected")
    turned = other.length_first != form.length_first

    def run(x: Values, kept: KeptValues) -> Values:
        y = kept[step.kept]
        if turned:
            y = y.swapaxes(1, 2)
        if form.owned and x.dtype.itemsize >= y.dtype.itemsize:
            return np.add(x, y, out=x)
        return np.asarray(x + y)

    return run, replace(form, owned=True)


def join(step: Join, form: Form, at: At) -> Built:
    """Build the value with kept values below it."""
    forms = [at.form_of_kept(name) for name in step.kept]
    for name, other in zip(step.kept, forms, strict=True):
        if other.shape[1:] != form.shape[1:]:
            raise at.refuse(f"shape {form.shape} comes to it and {name!r} has {other.shape}; they do not fit together")
    first = sum(other.shape[0] for other in (form, *forms))
    if first * form.size // form.shape[0] > LARGEST:
        raise at.refuse(f"{first} channels together; at most {LARGEST} numbers are run")
    turns = [(name, other.length_first != form.length_first) for name, other in zip(step.kept, forms, strict=True)]
    axis = _channel_axis(form)

    def run(x: Values, kept: KeptValues) -> Values:
        others = [kept[name].swapaxes(1, 2) if turned else kept[name] for name, turned in turns]
        return np.concatenate((x, *others), axis=axis)

    return run, replace(form, shape=(first, *form.shape[1:]), owned=True)


def part(step: Part, form: Form, at: At) -> Built:
    """Build the selection of some channels or numbers, or of some places."""
    if step.along == "length":
        sides(form, at)
    side = form.shape[1 if step.along == "length" else 0]
    if not step.start < step.stop <= side:
        raise at.refuse(f"{step.start} to before {step.stop} of {side} {step.along} is no part")
    channels = _channel_axis(form)
    axis = 3 - channels if step.along == "length" else channels
    taken = (slice(None),) * axis + (slice(step.start, step.stop),)
    count = step.stop - step.start
    shape = (form.shape[0], count) if step.along == "length" else (count, *form.shape[1:])

    def run(x: Values, _kept: KeptValues) -> Values:
        return x[taken]

    return run, replace(form, shape=shape)


def turn(step: Turn, form: Form, at: At) -> Built:  # noqa: ARG001 - a step that says nothing more
    """Build the transposition of channels and places; no number is moved, only read the other way."""
    channels, length = sides(form, at)

    def run(x: Values, _kept: KeptValues) -> Values:
        return x

    return run, replace(form, shape=(length, channels), length_first=not form.length_first)


def polar(step: Polar, form: Form, at: At) -> Built:  # noqa: ARG001
    """Build the conversion to magnitude and phase."""
    require_two(form, at, "real and imaginary parts")

    def run(x: Values, _kept: KeptValues) -> Values:
        real, imaginary = _two(x, form)
        return np.stack((np.hypot(real, imaginary), np.arctan2(imaginary, real)), axis=1)

    return run, Form(form.shape, owned=True)


def cartesian(step: Cartesian, form: Form, at: At) -> Built:  # noqa: ARG001
    """Build the conversion to real and imaginary parts."""
    require_two(form, at, "magnitudes and phases")

    def run(x: Values, _kept: KeptValues) -> Values:
        magnitude, phase = _two(x, form)
        return np.stack((magnitude * np.cos(phase), magnitude * np.sin(phase)), axis=1)

    return run, Form(form.shape, owned=True)


def require_two(form: Form, at: At, what: str) -> None:
    """Raise ModelFileError unless the step's input has two channels."""
    if sides(form, at)[0] != 2:
        raise at.refuse(f"shape {form.shape} comes to it; (2, length) is expected, {what}")


def _two(x: Values, form: Form) -> tuple[Values, Values]:
    return (x[:, :, 0], x[:, :, 1]) if form.length_first else (x[:, 0], x[:, 1])


def _channel_axis(form: Form) -> int:
    return 2 if form.length_first else 1

"""Run a trained model with NumPy alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.signals.arrays import Array
from palpate.signals.models.building import Form, Run, built
from palpate.signals.models.card import Card, Port
from palpate.signals.models.errors import ModelFileError, ModelInputError

AT_ONCE = 8
"""Number of inputs that are run together: more would leave the processor's cache."""


@dataclass(frozen=True)
class Model:
    """A model that was read: its card and its tensors. All shapes are checked when it is created.

    It holds no state between runs, so several threads may use one. Answers to one input and to the same input within
    a batch differ by rounding in the precision of its numbers.
    """

    card: Card
    tensors: Mapping[str, NDArray[Any]] = field(repr=False)
    _program: Run = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        program, form = built(self.card.steps, self.tensors, Form((self.card.takes.size,)))
        if form.shape != (self.card.gives.size,):
            raise ModelFileError(
                f"the steps end with shape {form.shape}, the card gives {self.card.gives.size} numbers. Export again."
            )
        object.__setattr__(self, "_program", program)

    def __reduce__(self) -> tuple[type[Model], tuple[Card, dict[str, NDArray[Any]]]]:
        return Model, (self.card, dict(self.tensors))

    def run(self, given: Array) -> Array:
        """Return the answer to one input (in,) as (out,), or to a batch (n, in) as (n, out), in float64.

        Raises:
            ModelInputError: another shape, numbers that are not real, a value that is not finite or outside the card's
                limits, or an input so extreme that the answer is not finite.
        """
        rows = _rows(given, self.card.takes, self.card.name)
        answers = np.empty((len(rows), self.card.gives.size))
        with np.errstate(over="ignore", invalid="ignore", under="ignore"):
            for start in range(0, len(rows), AT_ONCE):
                answers[start : start + AT_ONCE] = self._program(rows[start : start + AT_ONCE], {})
        if not np.isfinite(answers).all():
            row = int(np.flatnonzero(~np.isfinite(answers).all(axis=1))[0])
            raise ModelInputError(
                f"{self.card.name}: no finite answer to row {row + 1}: its numbers reach {np.abs(rows[row]).max():g} "
                f"{self.card.takes.unit}, far beyond what the model was trained for."
            )
        return answers if np.ndim(given) == 2 else answers[0]


def _rows(given: Any, takes: Port, name: str) -> Array:
    """Return the checked input as (n, in) in float64."""
    try:
        numbers = np.asarray(given)
    except ValueError:
        raise ModelInputError(f"{name}: rows of one length are expected.") from None
    if numbers.dtype.kind not in "iuf":
        raise ModelInputError(f"{name}: real numbers are expected, found {type(given).__name__} of {numbers.dtype}.")
    with np.errstate(over="ignore"):  # what is too large for float64 becomes infinite, and is refused as such
        rows = numbers.astype(np.float64)
    if rows.ndim not in (1, 2) or rows.shape[-1] != takes.size:
        raise ModelInputError(
            f"{name}: {takes.size} numbers ({takes.kind}, {takes.unit}) are expected for each input, "
            f"found an array of shape {rows.shape}."
        )
    rows = np.atleast_2d(rows)
    if not np.isfinite(rows).all():
        row, place = np.argwhere(~np.isfinite(rows))[0]
        raise ModelInputError(f"{name}: row {row + 1} holds {rows[row, place]} at place {place + 1}.")
    low, high = takes.within if takes.within is not None else (-np.inf, np.inf)
    if (bad := np.argwhere((rows < low) | (rows > high))).size:
        row, place = bad[0]
        raise ModelInputError(
            f"{name}: row {row + 1} holds {rows[row, place]:g} {takes.unit} at place {place + 1}; the model answers to "
            f"{low:g} to {high:g}. Correct the spike or leave this input out."
        )
    return rows

"""The fastest way to run a model on this machine: the compiled kernel where possible, else NumPy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.card import Card
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.runtime import Model

TRIED = 12
"""Number of inputs on which the kernel is checked when a model is opened."""
AGREES = 1e-3
"""Greatest accepted difference: single precision is a hundred times closer, an error is further off."""


class Runs(Protocol):
    """A model that can be run; `runtime` says by what, in a word or two."""

    @property
    def card(self) -> Card:
        """Return the model's card."""

    @property
    def runtime(self) -> str:
        """Return what runs the model: "native (AVX-512)" or "NumPy"."""

    def run(self, given: Array) -> Array:
        """Return the answer to (in,) as (out,), or to (n, in) as (n, out), in float64, as `Model.run` does.

        Raises ModelInputError as `Model.run` does.
        """


@dataclass(frozen=True)
class ByNumpy:
    """A model run by NumPy; `why` says why the kernel cannot run it."""

    model: Model = field(repr=False)
    why: str = ""
    runtime: str = "NumPy"

    @property
    def card(self) -> Card:
        """Return the model's card."""
        return self.model.card

    def run(self, given: Array) -> Array:
        """Return the answer as `Model.run` does."""
        return self.model.run(given)


def fastest(model: Model, instructions: str | None = None) -> Runs:
    """Return the model, run by the compiled kernel if it was built and supports all steps, else by NumPy.

    The kernel's answers are compared with NumPy's once, here; if they do not agree, NumPy is used. `instructions` names
    one of the kernel's instruction sets; None: the first that this processor has. Every call opens a workspace of its
    own.
    """
    from palpate.signals.models.native.library import KernelMissing, library
    from palpate.signals.models.native.opened import Native
    from palpate.signals.models.native.values import NotCompiled

    try:
        kernel = library()
        sets = [instruction_set for instruction_set in kernel.sets if instructions in (None, instruction_set.name)]
        if not sets:
            return ByNumpy(model, f"this processor has no {instructions}")
        runs = Native(model, kernel, sets[0], fastest)
    except (KernelMissing, NotCompiled) as error:
        return ByNumpy(model, str(error))
    far = apart(runs, model)
    return runs if far <= AGREES else ByNumpy(model, f"the kernel's answers are {far:.1e} off")


def apart(runs: Runs, model: Model) -> float:
    """Return the greatest difference between the two on a few inputs, relative to the size of the answers; inf if
    undefined.

    Where an answer may jump (a phase at its cut, the choice of a sparse attention), rounding may decide: the second
    largest difference counts.
    """
    # Inputs about what a texture's recording held, or about 0, within what the model answers to.
    chance, takes, texture = np.random.Generator(np.random.PCG64(1)), model.card.takes, model.card.texture
    rows = chance.standard_normal((TRIED, takes.size))
    if texture is not None and takes.size % 3 == 0:
        wide = rows.reshape(TRIED, 3, -1)
        wide[:, 0] *= texture.rms_m_s2
        for channel, ends in ((1, texture.speed_mm_s), (2, texture.force_N)):
            wide[:, channel] = chance.uniform(*ends, wide[:, channel].shape)
    if takes.within is not None:
        low, high = takes.within
        rows = np.clip(rows, low, high) if low < 1 and high > -1 else chance.uniform(low, high, rows.shape)
    try:
        answers, expected = runs.run(rows), model.run(rows)
    except ModelInputError:
        return float("inf")
    scale = max(float(np.abs(expected).max()), np.finfo(np.float32).tiny)
    return float(np.sort(np.abs(answers - expected).max(axis=1))[-2] / scale)

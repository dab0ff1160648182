"""Measure the time and the error of one step of a model on this machine, by runtime, on realistic inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from palpate.signals.arrays import Array
from palpate.signals.models.card import Card
from palpate.signals.models.fastest import Runs, fastest
from palpate.signals.models.file import read_model
from palpate.signals.models.runtime import Model
from palpate.signals.textures.sounds import RenderError
from palpate.signals.textures.voice import open_voice

WARM = 50
LEAST = 10


class Recorder:
    """A model that records its inputs."""

    def __init__(self, inner: Runs, steps: int) -> None:
        """Reserve room for `steps` inputs; later ones are not kept."""
        self.inner = inner
        self.given = np.zeros((steps, inner.card.takes.size))
        self.kept = 0

    @property
    def card(self) -> Card:
        """Return the recorded model's card."""
        return self.inner.card

    @property
    def runtime(self) -> str:
        """Return what runs the recorded model."""
        return self.inner.runtime

    def run(self, given: Array) -> Array:
        """Keep the input, and return the recorded model's answer."""
        if self.kept < len(self.given):
            self.given[self.kept] = given
            self.kept += 1
        return self.inner.run(given)


def step_us(card: Path | Model, steps: int, now_ns: Callable[[], int]) -> Mapping[str, tuple[float, float, float]]:
    """Return {runtime: (median us, p99 us, largest difference from float64 relative to the answers' SD)}.

    Raises:
        ModelFileError, RenderError: a file that is not a texture's model; fewer than 10 steps.
    """
    if steps < LEAST:
        raise RenderError(f"{steps} steps are timed; {LEAST} at least are expected.")
    model = card if isinstance(card, Model) else read_model(card)
    given = recorded_inputs(model, steps)
    exact = np.array([in_double(model).run(inputs) for inputs in given])
    spread = float(exact[:, 0].std()) or 1.0
    quick = fastest(model)
    runs: dict[str, Runs | Model] = {"NumPy": model, **({} if quick.runtime == "NumPy" else {quick.runtime: quick})}
    measured = {}
    for name, run in runs.items():
        for inputs in given[:WARM]:
            run.run(inputs)
        took = np.empty(len(given))
        for place, inputs in enumerate(given):
            start = now_ns()
            run.run(inputs)
            took[place] = now_ns() - start
        pairs = zip(given, exact, strict=True)
        error = float(max(np.abs(run.run(inputs) - answer).max() for inputs, answer in pairs))
        measured[name] = (float(np.median(took)) / 1e3, float(np.percentile(took, 99)) / 1e3, error / spread)
    return measured


def recorded_inputs(model: Model, steps: int) -> Array:
    """Return the inputs (steps, in) of a model that runs under a hand whose speed and force sweep its range."""
    recorder = Recorder(fastest(model), steps)
    voice = open_voice(model, seed=0, runs=lambda _model: recorder)
    texture = model.card.texture
    if texture is None:
        raise RenderError(f"{model.card.name}: no model of a texture.")
    phase = 0
    while recorder.kept < steps:
        speed, force = (
            low + (high - low) * (0.5 + 0.4 * np.sin(rate * phase))
            for (low, high), rate in ((texture.speed_mm_s, 0.0061), (texture.force_N, 0.0037))
        )
        voice.step(max(float(speed), 11.0), max(float(force), 0.16))
        phase += 1
    return recorder.given


def in_double(model: Model) -> Model:
    """Return the same model with its tensors in float64, as a reference."""
    wide = {
        name: tensor.astype(np.float64) if tensor.dtype.kind == "f" else tensor
        for name, tensor in model.tensors.items()
    }
    return replace(model, tensors=wide)

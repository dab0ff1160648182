"""Fitting one method to one texture, writing its file, and judging it one step ahead on the test part."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.judging_jobs import Context, Done, Fit
from palpate.modeling.textures.judging_kept import checkpoint, model_folder
from palpate.modeling.textures.methods import Fitted, Learning
from palpate.modeling.textures.metrics import explained, gfc, mae
from palpate.modeling.textures.outputs import write_texture
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from palpate.modeling.textures.windows import samples_of, windows
from palpate.modeling.training.history import curve_of, history_of
from palpate.signals.arrays import Array
from palpate.signals.textures.voice import play

LONGEST = 40
"""So many samples at the start of each test stretch are no one's to predict: all windows end with the same samples."""
Arrays = dict[str, NDArray[Any]]


def fitted(job: Fit, context: Context) -> Done:
    """The job's result. Raises what the method raises, and TextureDataError where there is nothing to test on."""
    model, numbers = fitted_for(job, context)
    recording, parts, method = context.recordings[job.texture], context.parts[job.texture], context.methods[job.method]
    card = None
    if not job.of_the_grid:
        card = write_texture(
            model_folder(job, context), recording, parts, model, method, with_start=True, seed=context.seed
        )
        numbers["bytes"] = float(sum(path.stat().st_size for path in card.parent.glob(f"{card.stem}.*")))
    if method.kind == "block":
        if card is None:
            raise TextureDataError(f"{job.method}: a method of spectra has neither a window nor a loss to compare.")
        actual, answered = _of_blocks(context, recording, parts, card)
    else:
        actual, answered = one_step(recording, parts, model)
    if job.of_the_grid:
        watched = windows(recording, parts.validation, model.window)
        numbers["validation_mae"] = mae(watched.wanted, model.predict(watched.given))
    told = {"window": float(model.window), **numbers, **step_numbers(actual, answered, recording, parts)}
    arrays = {} if job.of_the_grid else {"actual": actual, "answered": answered, **curve_of(model)}
    return Done(job, told, arrays, card)


def fitted_for(job: Fit, context: Context) -> tuple[Fitted, dict[str, float]]:
    """The fitted method, and the seconds and epochs of its training. Raises what the method raises."""
    own: dict[str, Any] = {} if job.loss is None else {"loss": job.loss}
    settings = {"threads": 1, **context.settings, **own, "checkpoint": checkpoint(job, context)}
    learning = Learning(
        context.recordings[job.texture], context.parts[job.texture], window=job.window, seed=context.seed,
        settings=settings,
    )  # fmt: skip
    start = context.clock()
    model = context.methods[job.method].fit(learning)
    took = context.clock() - start
    history = history_of(model)
    seconds = float(getattr(getattr(model, "trained", None), "seconds", took))
    told = {"train_s": seconds}
    return model, told | ({"epochs": float(len(history)), "epoch_s": seconds / len(history)} if history else {})


def one_step(recording: Recording, parts: Parts, model: Fitted) -> tuple[Array, Array]:
    """The test part's samples and what the model says of each from those before it, both (n,) in m/s^2.

    The same samples whatever the model's window. Raises TextureDataError where there are none.
    """
    found = windows(recording, _common(parts, model.window), model.window)
    return found.wanted, np.asarray(model.predict(found.given), dtype=np.float64)


def _common(parts: Parts, window: int) -> tuple[tuple[int, int], ...]:
    return tuple((start + max(LONGEST - window, 0), stop) for start, stop in parts.test)


def _of_blocks(context: Context, recording: Recording, parts: Parts, card: Path) -> tuple[Array, Array]:
    """The same samples of a model that does not look at the past: what it makes for the test part's hand."""
    kept = [np.arange(stop - start) >= LONGEST for start, stop in parts.test]
    acceleration, speed, force = samples_of(recording, parts.test)
    made = play(card, speed, force, context.seed)
    within = np.concatenate(kept)
    return acceleration[within], np.asarray(made)[within]


def step_numbers(actual: Array, answered: Array, recording: Recording, parts: Parts) -> dict[str, float | None]:
    """MAE in m/s^2 and in SDs of the training part's acceleration, GFC (raw, of the whole), variance explained."""
    off = mae(actual, answered)
    sd = float(np.std(samples_of(recording, parts.train)[0]))
    return {
        "mae_m_s2": off,
        "mae": off / sd if sd > 0 else None,
        "gfc": gfc(actual, answered),
        "explained": explained(actual, answered),
        "test_samples": float(len(actual)),
    }

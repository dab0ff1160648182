"""Fitting one method to one texture, writing its file, and scoring it one step ahead on the test part."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.textures.methods import Fitted, Learning, Method
from palpate.modeling.textures.metrics import explained, gfc, mae
from palpate.modeling.textures.outputs import write_texture
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from palpate.modeling.textures.windows import samples_of, windows
from palpate.modeling.training.history import curve_of, history_of
from palpate.protocols.progress import Clock
from palpate.signals.arrays import Array
from palpate.signals.textures.voice import play

LONGEST = 40
"""The samples at the start of each test stretch that no method predicts, so that all predict the same ones."""
Arrays = dict[str, NDArray[Any]]
Numbers = dict[str, float | None]


def learning_for(
    recording: Recording, parts: Parts, window: int | None, loss: str | None, seed: int, settings: Mapping[str, Any]
) -> Learning:
    """Return the data and options of a fit on one thread, with the given window and loss over the method's own."""
    own: dict[str, Any] = {} if loss is None else {"loss": loss}
    return Learning(recording, parts, window=window, seed=seed, settings={"threads": 1, **settings, **own})


def fit_and_score(
    method: Method, learning: Learning, folder: Path | None, clock: Clock
) -> tuple[Numbers, Arrays, tuple[Path, ...]]:
    """Fit the method, write its model into the folder, and score it on the test part.

    Return its numbers (see `one_step_scores`; also window, train_s, epochs, epoch_s, bytes), the truth ("actual") and
    the prediction ("answered") of the test part, both (n,) in m/s^2, with the learning curve, and the model's card and
    tensors. Without a folder the method is only compared with others: no file, no arrays, but `validation_mae`.

    Raises the method's errors, and TextureDataError where there is nothing to test on.
    """
    recording, parts = learning.recording, learning.parts
    start = clock()
    model = method.fit(learning)
    history = history_of(model)
    seconds = float(getattr(getattr(model, "trained", None), "seconds", clock() - start))
    epochs = {"epochs": float(len(history)), "epoch_s": seconds / len(history)} if history else {}
    numbers: Numbers = {"window": float(model.window), **{"train_s": seconds, **epochs}}
    card = None
    if folder is not None:
        card = write_texture(folder, recording, parts, model, method, with_start=True, seed=learning.seed)
        numbers["bytes"] = float(sum(path.stat().st_size for path in card.parent.glob(f"{card.stem}.*")))
    if method.kind == "block":
        if card is None:
            raise TextureDataError(f"{method.name}: a method of spectra has neither a window nor a loss to compare.")
        # the measured samples, and what a model that does not look at the past makes for the hand of the test part
        within = np.concatenate([np.arange(stop - start) >= LONGEST for start, stop in parts.test])
        acceleration, speed, force = samples_of(recording, parts.test)
        actual, predicted = acceleration[within], np.asarray(play(card, speed, force, learning.seed))[within]
    else:
        actual, predicted = predict_test_part(recording, parts, model)
    numbers |= one_step_scores(actual, predicted, recording, parts)
    if card is None:
        watched = windows(recording, parts.validation, model.window)
        return numbers | {"validation_mae": mae(watched.target, model.predict(watched.given))}, {}, ()
    arrays = {"actual": actual, "answered": predicted, **curve_of(model)}
    return numbers, arrays, (card, card.with_suffix(".safetensors"))


def predict_test_part(recording: Recording, parts: Parts, model: Fitted) -> tuple[Array, Array]:
    """Return the test part's samples and the prediction of each from those before it, both (n,) in m/s^2.

    The samples do not depend on the model's window. Raises TextureDataError where there are none.
    """
    common = tuple((start + max(LONGEST - model.window, 0), stop) for start, stop in parts.test)
    test = windows(recording, common, model.window)
    return test.target, np.asarray(model.predict(test.given), dtype=np.float64)


def one_step_scores(actual: Array, predicted: Array, recording: Recording, parts: Parts) -> Numbers:
    """Return the scores of a prediction of the test part.

    They are the MAE in m/s^2 and in SDs of the training part's acceleration, the GFC (raw, of the whole), the share of
    variance explained, and the number of samples.
    """
    off = mae(actual, predicted)
    sd = float(np.std(samples_of(recording, parts.train)[0]))
    return {
        "mae_m_s2": off,
        "mae": off / sd if sd > 0 else None,
        "gfc": gfc(actual, predicted),
        "explained": explained(actual, predicted),
        "test_samples": float(len(actual)),
    }

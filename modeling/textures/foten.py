"""FoTEN, the Fourier-enhanced transformer encoder network of thesis 4.4, its variants in Table 4.2 (without a spectral
block, with cepstral coefficients, with wavelets), and the generative one, which is ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from palpate.modeling.textures.fitting import Augmentation, FittedWindows, Make, fit_windows
from palpate.modeling.textures.foten_network import DROPOUT, WINDOW, Foten, FourierBlock, loss_named, nll
from palpate.modeling.textures.matching import MOST_GAIN, QUICK_ROUNDS, ROUNDS, Matched, match
from palpate.modeling.textures.methods import Learning, Method
from palpate.modeling.textures.spectral_features import MelBlock, WaveletBlock
from palpate.modeling.training.settings import Settings

GENERATIVE_WINDOW = 30
"""The window of the generative network: 20 ms hold no whole period of perceptible vibration below 50 Hz."""
SETTINGS = Settings(epochs=100, batch=16, learning_rate=1e-3, plateau_patience=None, stop_patience=10, every_epochs=5)
"""The settings of thesis 4.4.5."""
LOSS = "huber-1.6"
"""The loss of thesis 4.6.2 (also set by `Learning.settings["loss"]`, one of `foten_network.LOSSES`)."""
PATIENCE = 14
GENERATIVE_SETTINGS = Settings(
    epochs=14, batch=128, learning_rate=2e-3, plateau_patience=None, stop_patience=PATIENCE, every_epochs=4
)
GENERATIVE_ROWS = Augmentation(noise=0.01, hand=0.15, mirrored=True, rest=0.05, cosine=True)
STEPS, MOST_EPOCHS = 1550, 120
"""A short recording is trained on for more epochs: for as many steps as 14 epochs of 20 s have, at most 120 epochs, and
at most `PATIENCE` epochs after the best one on the validation part.
"""
FARTHEST_DB = 3.0
"""The greatest felt distance plus level error: about a just noticeable difference of amplitude (1.5 dB) each."""


def _fit_with(make: Make, window: int, loss: str) -> Callable[[Learning], FittedWindows]:
    """Return a fit of the network that `make` returns; the learning's settings override this loss and window."""

    def fit(learning: Learning) -> FittedWindows:
        chosen = loss_named(str(learning.settings.get("loss", loss)))
        return fit_windows(make, learning, chosen, SETTINGS, window=window)

    return fit


def literal(window: int) -> Foten:
    """Return the network of the thesis to the letter: layers normalise first (4.4.3), dropout everywhere (4.4.5).

    Dropout "within the entire network" follows the embedding and is also in the head. The width, which the thesis does
    not give, is our choice.
    """
    spectral = partial(FourierBlock, normalised_first=True)
    return Foten(window, spectral, normalised_first=True, head_dropout=DROPOUT)


def generative(window: int) -> Foten:
    """Return the network with a conditional scale, and without dropout, which would be learned as noise."""
    return Foten(window, generative=True, dropout=0.0)


def _fit_generative(learning: Learning) -> FittedWindows:
    settings = replace(GENERATIVE_SETTINGS, epochs=epochs_for(learning))
    fitted = fit_windows(generative, learning, nll, settings, window=GENERATIVE_WINDOW, augmentation=GENERATIVE_ROWS)
    matched = Matched(fitted.network, fitted.window)
    rounds = QUICK_ROUNDS if learning.settings.get("quick") else ROUNDS
    distance = match(matched, learning.recording, learning.parts, fitted.scale, learning.seed, rounds)
    gain = math.exp(float(matched.log_gain))
    learning.report(f"matched on its own output: {distance:.2f} dB off, gain of the SD {gain:.3f}")
    return replace(fitted, network=matched, missed=tuple(missed_aims(distance, gain)))


def missed_aims(distance_dB: float, gain: float) -> Iterator[str]:
    """Yield a sentence for each missed aim of `matching.match`: the distance, and a gain within its limits."""
    if not distance_dB <= FARTHEST_DB:
        reached = "could not be measured" if math.isnan(distance_dB) else f"is {distance_dB:.2f} dB"
        yield (
            f"On its own output its distance from the recording, felt and in level, {reached}; at most {FARTHEST_DB:g} "
            "dB is expected: record longer, or train longer."
        )
    if abs(math.log(gain)) > math.log(MOST_GAIN) - 1e-4:  # the limit itself, in single precision
        yield (
            f"The gain of its SD stopped at its limit, {gain:.3f}; more than {1 / MOST_GAIN:.3f} and less than "
            f"{MOST_GAIN:.3f} is expected: its level on its own output is off, so record longer, or train longer."
        )


def epochs_for(learning: Learning) -> int:
    """Return the number of epochs for `STEPS` steps, at least that of `GENERATIVE_SETTINGS`."""
    samples = sum(stop - start for start, stop in learning.parts.train)
    steps = max(1, math.ceil(samples / GENERATIVE_SETTINGS.batch))
    return min(MOST_EPOCHS, max(GENERATIVE_SETTINGS.epochs, round(STEPS / steps)))


FOTEN = Method(name="foten", title="FoTEN", fit=_fit_with(Foten, WINDOW, LOSS), window=WINDOW, source="thesis 4.4")
FOTEN_THESIS = Method(
    name="foten_thesis", title="FoTEN, to the letter", fit=_fit_with(literal, WINDOW, LOSS), window=WINDOW,
    source="thesis 4.4, normalised first and with dropout in the whole network",
)  # fmt: skip
FOTEN_GENERATIVE = Method(
    name="foten_generative",
    title="Generative FoTEN",
    fit=_fit_generative,
    window=GENERATIVE_WINDOW,
    sampled=True,
    source="thesis 4.4, with a conditional scale that is sampled when it runs (ours)",
)


TEN = Method(
    name="ten", title="TEN", fit=_fit_with(partial(Foten, spectral=None), 25, "huber-2.0"), window=25,
    source="thesis 4.6.3, Table 4.2",
)  # fmt: skip
TEN_MFCC = Method(
    name="ten_mfcc", title="TEN + MFCC", fit=_fit_with(partial(Foten, spectral=MelBlock), 30, LOSS), window=30,
    source="thesis 4.6.3, Table 4.2",
)  # fmt: skip
TEN_WAVELET = Method(
    name="ten_wavelet", title="TEN + wavelet", fit=_fit_with(partial(Foten, spectral=WaveletBlock), 30, "mse"),
    window=30, source="thesis 4.6.3, Table 4.2",
)  # fmt: skip

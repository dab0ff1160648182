"""Figures of touch: error and time of each method of computing features from 60 s of recording, on one core."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from palpate.analysis.features.touch import RATE_HZ, SEGMENT, Stretch, Touch, segments
from palpate.analysis.features.touch_features import (
    COEFFICIENTS,
    FLOOR,
    FRAME,
    frames,
    hand,
    mfcc,
    spectrum,
    touch_features,
    wavelets,
)
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array
from palpate.signals.one_axis import dft321, one_axis

AREA = "features of touch"
SECONDS, QUICK_SECONDS = 60.0, 10.0
CEPSTRA_ERROR = "largest difference from librosa's own, dB"
ENERGY_ERROR = "energy of a segment, largest relative error"
FINITE_ERROR = "numbers that are not finite"


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of cepstra beside librosa's, three axes on one, every kind of feature: 60 s, 10 s if `quick`."""
    seconds, repeats = (QUICK_SECONDS, 3) if quick else (SECONDS, 5)
    recording = strokes(seconds)
    yield from _cepstra(recording, repeats)
    yield from _on_one_axis(recording, repeats)
    yield from _kinds(recording, repeats)


def strokes(seconds: float, seed: int = 0) -> Touch:
    """Return noise on three axes at 1 kHz, with the level of a stroking hand."""
    chance = np.random.Generator(np.random.PCG64(seed))
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    speed = 80 + 70 * np.sin(2 * np.pi * 0.7 * t)
    axes = chance.standard_normal((len(t), 3)) * (speed / 80)[:, None] * np.array([1.0, 0.6, 1.4])
    return Touch("made up", (Stretch(axes, speed, 1.2 + 0.5 * np.cos(3 * t)),))


def _input_of(recording: Touch) -> tuple[str, int]:
    return f"{recording.seconds:g} s", round(recording.seconds * RATE_HZ)


def _cepstra(recording: Touch, repeats: int) -> Iterator[Case]:
    vibration = segments(recording).vibration
    expected = by_librosa(vibration)
    ways: dict[str, Callable[[], Array]] = {
        "palpate, all segments at once": lambda: mfcc(vibration),
        "librosa, segment by segment": lambda: by_librosa(vibration),
    }
    for name, run in ways.items():
        yield Case(
            AREA, "cepstral coefficients", name, *_input_of(recording), CEPSTRA_ERROR, run,
            lambda cepstra: float(np.abs(cepstra - expected).max()), repeats,
        )  # fmt: skip


def by_librosa(vibration: Array) -> Array:
    """Return cepstra (s, 40, 13) of segments (s, 500) by librosa, computed from the waveform of each frame."""
    import librosa

    cepstra = []
    for cut in frames(vibration):
        bands = librosa.feature.melspectrogram(
            y=cut.ravel(), sr=RATE_HZ, n_fft=FRAME, hop_length=FRAME, window="boxcar", center=False, n_mels=COEFFICIENTS
        )
        level = librosa.power_to_db(bands, amin=FLOOR, top_db=None)
        cepstra.append(librosa.feature.mfcc(S=level, n_mfcc=COEFFICIENTS).T)
    return np.stack(cepstra)


def _on_one_axis(recording: Touch, repeats: int) -> Iterator[Case]:
    (stretch,) = recording.stretches
    axes = stretch.axes[: len(stretch.axes) // SEGMENT * SEGMENT]
    expected = _energy((axes**2).sum(axis=1))
    ways: dict[str, Callable[[], Array]] = {
        "DFT321, segment by segment": lambda: np.ravel(segments(recording).vibration),
        "DFT321 in frames, as for rendering": lambda: one_axis(axes, RATE_HZ),
        "DFT321 of the whole recording": lambda: dft321(axes),
        "sum of the axes": lambda: np.asarray(axes.sum(axis=1)),
    }
    for name, run in ways.items():
        yield Case(
            AREA, "three axes on one", name, *_input_of(recording), ENERGY_ERROR, run,
            lambda axis: float(np.abs(_energy(axis**2) / expected - 1).max()), repeats,
        )  # fmt: skip


def _energy(power: Array) -> Array:
    """Return the energy of each segment."""
    return np.asarray(power.reshape(-1, SEGMENT).sum(axis=1))


def _kinds(recording: Touch, repeats: int) -> Iterator[Case]:
    cut = segments(recording)
    ways: dict[str, Callable[[], Array]] = {
        "mfcc": lambda: mfcc(cut.vibration),
        "hand": lambda: hand(cut.speed_mm_s, cut.force_N),
        "dft": lambda: spectrum(cut.vibration),
        "dwt": lambda: wavelets(cut.vibration),
        "all of them, from filtered axes on": lambda: np.concatenate(list(touch_features(recording).values()), axis=1),
    }
    for name, run in ways.items():
        yield Case(
            AREA, "features of a recording", name, *_input_of(recording), FINITE_ERROR, run,
            lambda features: float((~np.isfinite(features)).sum()), repeats,
        )  # fmt: skip

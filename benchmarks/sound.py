"""Figures of the masking noise: its level and spectrum as played, against the declared ones."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from palpate.devices.sound.noise import FULL_SCALE_RMS, LOOP_S, Colour, Player, a_weighted_db, loop, rms_of
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

AREA = "sound"
RATE_HZ = 48_000
LEVEL_DBFS = -35.0
SEED = 5
CENTRES_HZ = 1000 * 10 ** (np.arange(-15, 12) / 10)
"""Third octaves from 32 Hz to 12.6 kHz (IEC 61260-1, base ten)."""


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of ten seconds of noise from the middle of the loop, beside independent random samples.

    `quick` measures white noise only.
    """
    colours: tuple[Colour, ...] = ("white",) if quick else ("white", "pink")
    count = RATE_HZ * LOOP_S
    for colour in colours:
        ways = {"palpate": partial(play_once, colour)}
        if colour == "white":
            ways["random samples"] = partial(random_samples)
        input_name = f"{colour}, {LOOP_S} s at {RATE_HZ} Hz"
        for case, kind, error in (
            ("level", "dB off the declared level", level_error_db),
            ("each second's level", "dB at most off the declared level", second_error_db),
            ("third octaves", "dB at most off the declared spectrum", partial(spectrum_error_db, colour)),
            ("A-weighted level", "dB off the declared one", partial(a_error_db, colour)),
        ):
            for method, run in ways.items():
                yield Case(AREA, f"masking noise: {case}", method, input_name, count, kind, run, error, 3)


def play_once(colour: Colour) -> Array:
    """Make the loop and play it once through the player, starting in its middle, as an output would."""
    player = Player(loop(colour, RATE_HZ, SEED) * rms_of(LEVEL_DBFS))
    player.fader.to(1.0, 1)
    player.fill(RATE_HZ * LOOP_S // 2)
    return np.concatenate([player.fill(RATE_HZ // 100) for _ in range(100 * LOOP_S)])


def random_samples() -> Array:
    """Return independent Gaussian samples of the declared level between 20 Hz and 20 kHz."""
    noise = np.random.Generator(np.random.PCG64(SEED)).standard_normal(RATE_HZ * LOOP_S)
    hz = np.fft.rfftfreq(len(noise), 1 / RATE_HZ)
    inside = (hz >= 20) & (hz <= 20_000)
    return np.fft.irfft(np.fft.rfft(noise) * inside, len(noise)) * rms_of(LEVEL_DBFS) / math.sqrt(inside.mean())


def level_error_db(samples: Array) -> float:
    """Return how far the level lies from the declared one, in dB."""
    return abs(_level_dbfs(float(np.mean(samples**2))) - LEVEL_DBFS)


def second_error_db(samples: Array) -> float:
    """Return the level error of the second that deviates most, in dB."""
    return max(map(level_error_db, samples.reshape(-1, RATE_HZ)))


def spectrum_error_db(colour: Colour, samples: Array) -> float:
    """Return the largest deviation of a third octave's level from a flat (white) or a falling (pink) spectrum."""
    hz, power = _power(samples)
    declared = np.where((hz >= 20) & (hz <= 20_000), 1.0 if colour == "white" else 1 / np.maximum(hz, 1), 0.0)
    declared *= rms_of(LEVEL_DBFS) ** 2 / declared.sum()
    bands = [(hz >= centre * 10**-0.05) & (hz < centre * 10**0.05) for centre in CENTRES_HZ]
    return max(abs(10 * math.log10(float(power[band].sum() / declared[band].sum()))) for band in bands)


def a_error_db(colour: Colour, samples: Array) -> float:
    """Return how far the samples' A-weighted level lies from the declared one, in dB.

    The weighting is computed here from its four poles (IEC 61672-1, Annex E), not taken from the product.
    """
    hz, power = _power(samples)
    s = 2j * np.pi * hz[1:]
    poles = [2 * np.pi * f for f in (20.598997, 20.598997, 107.65265, 737.86223, 12194.217, 12194.217)]
    gain = np.abs(s**4 / np.prod([s + pole for pole in poles], axis=0))
    at = 2j * np.pi * 1000.0
    gain /= abs(at**4 / np.prod([at + pole for pole in poles]))
    level = _level_dbfs(float(np.sum(power[1:] * gain**2)))
    return abs(level - (LEVEL_DBFS + a_weighted_db(colour, RATE_HZ)))


def _power(samples: Array) -> tuple[Array, Array]:
    """Return the frequencies, and the mean square in each line."""
    lines = np.abs(np.fft.rfft(samples)) ** 2 / len(samples) ** 2
    return np.asarray(np.fft.rfftfreq(len(samples), 1 / RATE_HZ), dtype=np.float64), 2 * lines


def _level_dbfs(mean_square: float) -> float:
    return 20 * math.log10(math.sqrt(mean_square) / FULL_SCALE_RMS)

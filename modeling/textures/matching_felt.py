"""The least change of a linear predictor and of its noise with which what was made feels as what was recorded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from palpate.modeling.textures.metrics import density
from palpate.modeling.textures.metrics_felt import third_octaves
from palpate.modeling.textures.recording import RATE_HZ
from palpate.protocols.vibration_threshold import BANDS_HZ, threshold_m_s2
from palpate.signals.arrays import Array

KEPT = 0.3
"""How much an RMS change of the spectrum by 1 dB counts beside a third octave that is 1 dB off: what is not felt to
differ stays as it is."""
LOWEST_HZ = 20.0
"""Recordings hold nothing below (thesis 4.3.3)."""
NEAREST = 1e-6
"""A predictor's response is never taken to be smaller, so that a pole on the unit circle has a logarithm."""
ATTEMPTS = 60
_DB = 10 / np.log(10)


def correction(truth: Array, made: Array, own: Array, stiff: float) -> tuple[Array, float]:
    """What to add to a predictor's weights (order,), oldest sample first, and to the log of its noise's SD.

    `truth` and `made` (n,) in m/s^2 are what was recorded and what the model made on its own output; `own` is the
    linear predictor of what was made; `stiff` is how many dB a change of a weight by 1 counts: the model is no
    recursion, and how far this one speaks for it is for the caller to try (Levenberg 1944). Where the predictor W of a
    recursion is changed to W + D and its noise by g, its spectrum changes by e^2g |1 - W|^2 / |1 - W - D|^2; D and g
    are the least-squares solution that brings the levels of all third octaves above the vibrotactile threshold to the
    recording's. A linear predictor of what was recorded would not do: it is fitted to the peaks of a spectrum, and what
    lies 15 dB below them is felt as well. Raises TextureDataError where either is too short for a spectrum.
    """
    hertz, wanted = density(truth)
    found = density(made)[1]
    weigh = third_octaves(hertz) * (hertz[1] / _thresholds() ** 2)
    lags = np.exp(-2j * np.pi * hertz[:, None] / RATE_HZ * np.arange(len(own), 0, -1))
    whitened, heard, goal = 1 - lags @ own, hertz >= LOWEST_HZ, _felt(weigh @ wanted)

    def off(change: Array) -> Array:
        response = np.maximum(np.abs(whitened - lags @ change[:-1]), NEAREST)
        more = 2 * (change[-1] + np.log(np.maximum(np.abs(whitened), NEAREST) / response))
        spread = KEPT * _DB * more[heard] / np.sqrt(heard.sum())
        return np.concatenate([_felt(weigh @ (found * np.exp(more))) - goal, spread, stiff * change[:-1]])

    best = least_squares(off, np.zeros(len(own) + 1), max_nfev=ATTEMPTS).x
    return np.asarray(best[:-1]), float(best[-1])


def _felt(power: Array) -> Array:
    """Power over that at the threshold, in dB: smooth at 0, where a level ends that nobody feels."""
    return np.asarray(_DB * np.log1p(power))


def _thresholds() -> NDArray[np.float64]:
    return np.array([[threshold_m_s2(middle)] for middle in BANDS_HZ])

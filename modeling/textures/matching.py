"""The linear correction that makes a sampled model, on its own output, feel like the recording.

One step ahead, small errors of mean and SD hardly change the likelihood; on the model's own output they accumulate with
every step, most at frequencies of which a window holds less than a period.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import PCG64, Generator, SeedSequence
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares
from torch import Tensor, nn

from palpate.modeling.textures.metrics import SMOOTHED, density, felt_distance, level_ratio, third_octaves
from palpate.modeling.textures.recording import RATE_HZ, Parts, Recording, Scale
from palpate.modeling.textures.windows import Stretches
from palpate.modeling.training.seeding import training_state
from palpate.signals.arrays import Array
from palpate.signals.textures.gate import sounds
from palpate.signals.vibration_threshold import BANDS_HZ, threshold_m_s2

ROUNDS, QUICK_ROUNDS, DRAWS = 8, 1, 6
"""The number of corrections that are tried in turn, and of runs of each with different random numbers."""
SHARE = 0.8
"""The share of the correction that is applied at a time."""
STIFF, STIFFER = 5.0, 4.0
"""The initial cost in dB of a change of a weight by 1, and its factor after a correction that did not help."""
MOST_GAIN = 1.25
"""The limit of the SD's gain and of its inverse: more would hide a wrong model."""
LONGEST = 1000
"""Most samples of a stretch in a free run: longer ones are cut, so that all run side by side."""
RIDGE = 1e-6
"""White noise, as a share of the power, with which the normal equations of a smooth signal can be solved."""
_USE = 72
"""Distinguishes this use of a seed from the others."""
KEPT = 0.3
"""The weight of an RMS change of the spectrum by 1 dB relative to an error of a third octave of 1 dB: what does not
feel different is not changed.
"""
LOWEST_HZ = 20.0
"""Lowest frequency: recordings hold nothing below (thesis 4.3.3)."""
NEAREST = 1e-6
"""Least magnitude of a predictor's response, so that a pole on the unit circle has a finite logarithm."""
ATTEMPTS = 60
_DB = 10 / np.log(10)


class Matched(nn.Module):
    """A network (batch, 3, window) to mean and log SD (batch, 2), with a linear correction of both.

    A linear function of the past is added to the mean, and a number to the log SD. Both are 0 until `match` sets them.
    """

    weight: Tensor
    log_gain: Tensor

    def __init__(self, network: nn.Module, window: int) -> None:
        super().__init__()
        self.network = network
        self.register_buffer("weight", torch.zeros(window))
        self.register_buffer("log_gain", torch.zeros(()))

    def forward(self, x: Tensor) -> Tensor:
        """Return the corrected mean and log SD, (batch, 2), for windows (batch, 3, window)."""
        answer = self.network(x)
        more = (x[:, 0] * self.weight).sum(dim=1, keepdim=True)
        return torch.cat([answer[:, :1] + more, answer[:, 1:] + self.log_gain], dim=1)


def match(network: Matched, recording: Recording, parts: Parts, scale: Scale, seed: int, rounds: int = ROUNDS) -> float:
    """Set the correction with which the network, on its own output, feels most like the recording; return its distance.

    It runs freely along the speeds and forces of the training and validation parts, from the recorded window before
    each stretch; a share of the result of `correction` is added, repeatedly. The correction with the least distance
    (felt distance plus level error, in dB) is chosen. Neither the test part nor the output at rest, where the renderer
    is silent, is used. Equal seeds give equal bits. Returns nan, without a correction, where too little is recorded.
    """
    window = len(network.weight)
    cut = [
        (at, min(at + LONGEST, stop))
        for start, stop in (*parts.train, *parts.validation)
        for at in range(start, stop, LONGEST)
    ]
    stretches = [(start, stop) for start, stop in cut if stop - start > 2 * window]
    # the acceleration of all stretches after their first window, 0 at rest; and where it is heard
    pieces = [recording.signals[:, start + window : stop] for start, stop in stretches]
    acceleration, speed, force = np.concatenate(pieces or [np.zeros((3, 0))], axis=1)
    heard = sounds(speed, force)
    truth = acceleration * heard
    if heard.sum() < SMOOTHED or not truth.any():
        return math.nan
    ends = np.cumsum([stop - start - window for start, stop in stretches])[:-1]
    stiff, truths = STIFF, np.tile(truth, DRAWS)
    best = _Candidate(math.inf, network.weight.clone(), network.log_gain.clone(), truths, np.zeros(window))
    for left in range(rounds, -1, -1):
        played = free_run(network, recording, stretches, scale, seed, DRAWS)
        finite: Array = np.nan_to_num(played, nan=0.0, posinf=0.0, neginf=0.0)  # silence is left of what runs away
        runs = heard * finite
        made = runs.reshape(-1)
        ratio = level_ratio(made, truths)
        distance = felt_distance(truths, made) + abs(20 * math.log10(ratio)) if ratio else math.inf
        if distance < best.distance:
            own = predictor([part for run in runs for part in np.split(run, ends)], window)
            best = _Candidate(distance, network.weight.clone(), network.log_gain.clone(), made, own)
        else:
            stiff *= STIFFER
        best.apply(network)
        if left and math.isfinite(best.distance):
            # a share of what the network lacks, within limits
            weights, gain = correction(truths, best.made, best.own, stiff)
            network.weight += torch.from_numpy((SHARE * weights).astype(np.float32))
            network.log_gain.add_(SHARE * gain).clamp_(-math.log(MOST_GAIN), math.log(MOST_GAIN))
    return best.distance


@dataclass(frozen=True)
class _Candidate:
    """A correction, with the network's distance and output under it, and the linear predictor of that output."""

    distance: float
    weight: Tensor
    log_gain: Tensor
    made: Array
    own: Array

    def apply(self, network: Matched) -> None:
        """Set the network's correction."""
        network.weight.copy_(self.weight)
        network.log_gain.copy_(self.log_gain)


def free_run(
    network: Matched,
    recording: Recording,
    stretches: Stretches,
    scale: Scale,
    seed: int,
    draws: int = 1,
) -> Array:
    """Return the network's outputs for each stretch after its first window, one after another: (draws, n) in m/s^2."""
    window = len(network.weight)
    longest = max(stop - start for start, stop in stretches)
    hand = torch.zeros(len(stretches), 3, longest)
    for row, (start, stop) in zip(hand, stretches, strict=True):
        row[:, : stop - start] = torch.from_numpy(scale.down(recording.signals[:, start:stop]).astype(np.float32))
    hand = hand.repeat(draws, 1, 1)
    chance = Generator(PCG64(SeedSequence([seed, _USE])))
    drawn = torch.from_numpy(chance.standard_normal((longest, len(hand))).astype(np.float32))
    with training_state(0, 1), torch.no_grad():
        network.eval()
        for at in range(window, longest):
            mean, log_sd = network(hand[:, :, at - window : at]).unbind(dim=1)
            hand[:, 0, at] = mean + log_sd.exp() * drawn[at]
    ends = [stop - start for start, stop in stretches] * draws
    made = torch.cat([row[0, window:end] for row, end in zip(hand, ends, strict=True)]).reshape(draws, -1)
    result: Array = made.numpy().astype(np.float64) * scale.sd[0] + scale.mean[0]
    return result


def predictor(stretches: Sequence[Array], order: int) -> Array:
    """Return the linear predictor (order,) of stretches, oldest sample's weight first; zeros for silence.

    Source: the autocorrelation method (Makhoul 1975).
    """
    lags = np.zeros(order + 1)
    for stretch in stretches:
        lags += np.correlate(stretch, stretch, "full")[len(stretch) - 1 :][: order + 1]
    lags[0] *= 1 + RIDGE
    return np.asarray(solve_toeplitz(lags[:-1], lags[1:])[::-1]) if lags[0] > 0 else np.zeros(order)


def correction(truth: Array, made: Array, own: Array, stiff: float) -> tuple[Array, float]:
    """Return what to add to a predictor's weights (order,), oldest sample first, and to the log of its noise's SD.

    `truth` and `made` (n,) in m/s^2 are the recording and the model's free run; `own` is the linear predictor of the
    latter; `stiff` is the cost in dB of a change of a weight by 1: the model is no linear recursion, so the caller must
    find how far this approximation holds (Levenberg 1944). Where the predictor W of a recursion is changed to W + D and
    its noise by g, its spectrum changes by e^2g |1 - W|^2 / |1 - W - D|^2; D and g are the least-squares solution that
    brings the levels of all third octaves above the vibrotactile threshold to the recording's. A linear predictor of
    the recording would not suffice: it is fitted to the peaks of a spectrum, but components 15 dB below them are felt
    as well. Raises TextureDataError where either is too short for a spectrum.
    """
    hertz, true_power = density(truth)
    made_power = density(made)[1]
    weigh = third_octaves(hertz) * (hertz[1] / np.array([[threshold_m_s2(middle)] for middle in BANDS_HZ]) ** 2)
    lags = np.exp(-2j * np.pi * hertz[:, None] / RATE_HZ * np.arange(len(own), 0, -1))
    whitened, heard, goal = 1 - lags @ own, hertz >= LOWEST_HZ, _felt_dB(weigh @ true_power)

    def off(change: Array) -> Array:
        response = np.maximum(np.abs(whitened - lags @ change[:-1]), NEAREST)
        more = 2 * (change[-1] + np.log(np.maximum(np.abs(whitened), NEAREST) / response))
        spread = KEPT * _DB * more[heard] / np.sqrt(heard.sum())
        return np.concatenate([_felt_dB(weigh @ (made_power * np.exp(more))) - goal, spread, stiff * change[:-1]])

    best = least_squares(off, np.zeros(len(own) + 1), max_nfev=ATTEMPTS).x
    return np.asarray(best[:-1]), float(best[-1])


def _felt_dB(power: Array) -> Array:
    """Return power over that at the threshold in dB, smooth towards 0 for levels that are not felt."""
    return np.asarray(_DB * np.log1p(power))

"""A linear correction brings a sampled model to the recording's level and spectrum on its own output, within limits."""

import math

import numpy as np
import pytest
import torch
from scipy.signal import lfilter

from palpate.modeling.textures.matching import MOST_GAIN, Matched, correction, free_run, match, predictor
from palpate.modeling.textures.metrics import felt_distance, felt_levels
from palpate.modeling.textures.recording import Parts, Recording, Scale, TextureDataError

pytestmark = pytest.mark.needs("torch")

PARTS = Parts(((0, 3000), (3500, 5000)), ((5000, 6000),), ((3000, 3500),))
SCALE = Scale(np.array([0.0, 80.0, 1.0]), np.array([2.0, 1.0, 1.0]))
WINDOW = 5


class Recursion(torch.nn.Module):
    """a[n] = pull a[n - 1] + SD e; the recording is made so too, with a pull of 0.9 and an SD of 0.4."""

    def __init__(self, sd, pull=0.9):
        super().__init__()
        self.log_sd, self.pull = math.log(sd), pull

    def forward(self, x):
        return torch.stack([self.pull * x[:, 0, -1], torch.full((len(x),), self.log_sd)], dim=1)


def network(sd=0.4, pull=0.9):
    return Matched(Recursion(sd, pull), WINDOW)


def recursive_recording(sd=0.4, n=6000):
    noise = np.random.Generator(np.random.PCG64(2)).standard_normal(n)
    signal = np.zeros(n)
    for at in range(1, n):
        signal[at] = 0.9 * signal[at - 1] + sd * noise[at]
    return Recording("made", "made", np.stack([2 * signal, np.full(n, 80.0), np.ones(n)]))


def newest(matched):
    return matched.weight[-1].item() + matched.network.pull


@pytest.mark.parametrize("off", [0.87, 1.0, 1.12])
def test_an_sd_that_is_off_is_put_right(off):
    matched = network(0.4 * off)
    left = match(matched, recursive_recording(), PARTS, SCALE, 0)
    assert math.exp(matched.log_gain) * off == pytest.approx(1.0, abs=0.06)
    assert newest(matched) == pytest.approx(0.9, abs=0.05)
    assert left < 1.0


@pytest.mark.parametrize("pull", [0.7, 0.95])
def test_a_predictor_that_is_off_is_put_right(pull):
    matched, spoilt = network(pull=pull), network(pull=pull)
    left, before = (
        match(matched, recursive_recording(), PARTS, SCALE, 0),
        match(spoilt, recursive_recording(), PARTS, SCALE, 0, rounds=0),
    )
    assert abs(newest(matched) - 0.9) < abs(pull - 0.9) / 1.5
    assert not spoilt.weight.any()
    assert left < before / 2


def test_a_gain_has_limits():
    for sd, most in ((0.1, MOST_GAIN), (2.0, 1 / MOST_GAIN)):
        matched = network(sd)
        match(matched, recursive_recording(), PARTS, SCALE, 0)
        assert math.exp(matched.log_gain) == pytest.approx(most)


def corrections(*recordings):
    for recording in recordings:
        matched = network(0.35, 0.85)
        match(matched, recording, PARTS, SCALE, 0)
        yield matched


def test_what_is_made_at_rest_does_not_count_and_rest_alone_is_left_as_it_is():
    plain, loud_at_rest = recursive_recording(), recursive_recording()
    for recording in (plain, loud_at_rest):
        recording.signals[2, 1000:2000] = 0.05
    loud_at_rest.signals[0, 1010:2000] *= 50
    one, other = corrections(plain, loud_at_rest)
    assert one.log_gain.item() == pytest.approx(other.log_gain.item(), abs=0.03)
    assert torch.allclose(one.weight, other.weight, atol=0.05)
    plain.signals[2] = 0.05
    (left,) = corrections(plain)
    assert not left.weight.any()
    assert math.isnan(match(network(), plain, PARTS, SCALE, 0))


def test_the_test_part_is_not_looked_at():
    plain, loud = recursive_recording(), recursive_recording()
    loud.signals[0, 3000:3500] *= 50
    one, other = corrections(plain, loud)
    assert torch.equal(one.weight, other.weight)
    assert torch.equal(one.log_gain, other.log_gain)


def test_a_network_that_runs_away_is_left_as_it_is():
    matched = network(pull=1.5)
    match(matched, recursive_recording(), PARTS, SCALE, 0)
    assert torch.isfinite(matched.weight).all()
    assert torch.isfinite(matched.log_gain)


def test_a_free_run_begins_with_what_was_recorded_and_is_repeatable():
    one, same, other = (
        free_run(network(), recursive_recording(), [(0, 400), (400, 900)], SCALE, seed, 2) for seed in (1, 1, 2)
    )
    assert one.shape == (2, 395 + 495)
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)
    assert not np.array_equal(*one)


def test_the_predictor_of_a_recursion_is_its_own():
    weights = predictor([recursive_recording(0.5).signals[0]], 3)
    assert weights == pytest.approx([0.0, 0.0, 0.9], abs=0.03)
    assert not predictor([np.zeros(100)], 3).any()


ORDER, STIFF = 20, 2.0


def recursion(weights, sd=1.0, n=60_000, seed=1):
    """a[n] = weights . past (oldest first) + SD e."""
    noise = np.random.Generator(np.random.PCG64(seed)).standard_normal(n)
    return lfilter([sd], np.r_[1.0, -np.asarray(weights)[::-1]], noise)


def own(*poles):
    """Weights (ORDER,) of a recursion with these poles and their conjugates, oldest first."""
    whole = np.real(np.poly([root for pole in poles for root in (pole, np.conj(pole))]))
    return np.r_[np.zeros(ORDER - len(whole) + 1), -whole[:0:-1]]


def pole(hertz, radius):
    return radius * np.exp(2j * np.pi * hertz / 1000)


PEAK = own(pole(200, 0.95))


def test_what_lies_far_below_the_peak_is_brought_to_its_level():
    truth, generated = recursion(own(pole(200, 0.95), pole(28, 0.9)), 0.02), recursion(PEAK, 0.4, seed=2)
    weights, gain = correction(truth, generated, PEAK, STIFF)
    after = recursion(PEAK + weights, 0.4 * np.exp(gain), seed=3)
    assert felt_distance(truth, generated) > 4
    assert felt_distance(truth, after) < 0.5


def test_a_level_alone_is_put_right_by_more_noise():
    truth, generated = recursion(PEAK, 0.5), recursion(PEAK, 0.4)
    weights, gain = correction(truth, generated, PEAK, STIFF)
    assert gain > 0.1
    assert felt_distance(truth, generated) > 0.8
    assert felt_distance(truth, recursion(PEAK + weights, 0.4 * np.exp(gain))) < 0.2


def test_what_feels_equal_is_left_as_it_is_and_so_is_what_nobody_feels():
    signal = recursion(PEAK)
    weights, gain = correction(signal, signal, PEAK, STIFF)
    assert np.abs([*weights, gain]).max() < 1e-6
    faint, fainter = 1e-7 * signal, 3e-8 * recursion(own(pole(60, 0.5)))
    assert not felt_levels(faint).any()
    weights, gain = correction(faint, fainter, PEAK, STIFF)
    assert np.abs([*weights, gain]).max() < 1e-3


def test_equal_input_gives_equal_bits_and_a_short_one_is_refused():
    truth, generated = recursion(PEAK, n=3000), recursion(PEAK, 0.7, n=3000, seed=2)
    one, other = correction(truth, generated, PEAK, STIFF), correction(truth, generated, PEAK, STIFF)
    assert np.array_equal(one[0], other[0])
    assert one[1] == other[1]
    with pytest.raises(TextureDataError, match="256 finite samples"):
        correction(truth[:100], generated, PEAK, STIFF)


def test_silence_and_a_pole_on_the_circle_have_a_finite_answer():
    truth = recursion(PEAK)
    for generated, at in ((np.zeros(3000), np.zeros(ORDER)), (recursion(PEAK), own(pole(200, 1.0)))):
        weights, gain = correction(truth, generated, at, STIFF)
        assert np.isfinite([*weights, gain]).all()

"""The least change of a predictor after which all third octaves are felt as they were recorded."""

import numpy as np
import pytest
from scipy.signal import lfilter

from palpate.modeling.textures.matching import correction
from palpate.modeling.textures.metrics import felt_distance, felt_levels
from palpate.modeling.textures.recording import TextureDataError

pytestmark = pytest.mark.needs("torch")

ORDER, STIFF = 20, 2.0


def recursion(weights, sd=1.0, n=60_000, seed=1):
    """a[n] = weights . past (oldest first) + SD e."""
    noise = np.random.Generator(np.random.PCG64(seed)).standard_normal(n)
    return lfilter([sd], np.r_[1.0, -np.asarray(weights)[::-1]], noise)


def own(*poles):
    """Weights (ORDER,) of a recursion with these poles and their conjugates, oldest first."""
    whole = np.real(np.poly([each for pole in poles for each in (pole, np.conj(pole))]))
    return np.r_[np.zeros(ORDER - len(whole) + 1), -whole[:0:-1]]


def pole(hertz, radius):
    return radius * np.exp(2j * np.pi * hertz / 1000)


PEAK = own(pole(200, 0.95))


def test_what_lies_far_below_the_peak_is_brought_to_its_level():
    truth, made = recursion(own(pole(200, 0.95), pole(28, 0.9)), 0.02), recursion(PEAK, 0.4, seed=2)
    weights, gain = correction(truth, made, PEAK, STIFF)
    after = recursion(PEAK + weights, 0.4 * np.exp(gain), seed=3)
    assert felt_distance(truth, made) > 4
    assert felt_distance(truth, after) < 0.5


def test_a_level_alone_is_put_right_by_more_noise():
    truth, made = recursion(PEAK, 0.5), recursion(PEAK, 0.4)
    weights, gain = correction(truth, made, PEAK, STIFF)
    assert gain > 0.1
    assert felt_distance(truth, made) > 0.8
    assert felt_distance(truth, recursion(PEAK + weights, 0.4 * np.exp(gain))) < 0.2


def test_what_feels_equal_is_left_as_it_is_and_so_is_what_nobody_feels():
    made = recursion(PEAK)
    weights, gain = correction(made, made, PEAK, STIFF)
    assert np.abs([*weights, gain]).max() < 1e-6
    faint, fainter = 1e-7 * made, 3e-8 * recursion(own(pole(60, 0.5)))
    assert not felt_levels(faint).any()
    weights, gain = correction(faint, fainter, PEAK, STIFF)
    assert np.abs([*weights, gain]).max() < 1e-3


def test_equal_input_gives_equal_bits_and_a_short_one_is_refused():
    truth, made = recursion(PEAK, n=3000), recursion(PEAK, 0.7, n=3000, seed=2)
    one, other = correction(truth, made, PEAK, STIFF), correction(truth, made, PEAK, STIFF)
    assert np.array_equal(one[0], other[0])
    assert one[1] == other[1]
    with pytest.raises(TextureDataError, match="256 finite samples"):
        correction(truth[:100], made, PEAK, STIFF)


def test_silence_and_a_pole_on_the_circle_have_a_finite_answer():
    truth = recursion(PEAK)
    for made, at in ((np.zeros(3000), np.zeros(ORDER)), (recursion(PEAK), own(pole(200, 1.0)))):
        weights, gain = correction(truth, made, at, STIFF)
        assert np.isfinite([*weights, gain]).all()

"""A gain of the SD brings a sampled model to the recording's level on its own output, within limits."""

import math

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from modeling.textures.exporting_foten import pieces  # noqa: E402
from modeling.textures.heads import LEAST_LOG_SD, Spread  # noqa: E402
from modeling.textures.levelling import MOST_GAIN, free_run, level_alike  # noqa: E402
from modeling.textures.recording import Parts, Recording, Scale  # noqa: E402

PARTS = Parts(((0, 3000), (3500, 5000)), ((5000, 6000),), ((3000, 3500),))
SCALE = Scale(np.array([0.0, 80.0, 1.0]), np.array([2.0, 1.0, 1.0]))


class Recursion(torch.nn.Module):
    """a[n] = 0.9 a[n - 1] + SD e, which is what the recording was made by, but for the SD."""

    def __init__(self, sd):
        super().__init__()
        self.spread = Spread()
        self.raw = math.log(math.expm1(math.log(sd) - LEAST_LOG_SD))

    def forward(self, x):
        return self.spread(torch.stack([0.9 * x[:, 0, -1], torch.full((len(x),), self.raw)], dim=1))


def made(sd=0.4, n=6000):
    noise = np.random.Generator(np.random.PCG64(2)).standard_normal(n)
    signal = np.zeros(n)
    for at in range(1, n):
        signal[at] = 0.9 * signal[at - 1] + sd * noise[at]
    return Recording("made", "made", np.stack([2 * signal, np.full(n, 80.0), np.ones(n)]))


@pytest.mark.parametrize("off", [0.87, 1.0, 1.12])
def test_an_sd_that_is_off_is_put_right(off):
    network = Recursion(0.4 * off)
    gain = level_alike(network, made(), PARTS, SCALE, 5, 0)
    assert gain * off == pytest.approx(1.0, abs=0.06)
    assert network.spread.log_gain.item() == pytest.approx(math.log(gain), abs=1e-6)


def test_a_gain_has_limits():
    assert level_alike(Recursion(0.1), made(), PARTS, SCALE, 5, 0) == MOST_GAIN
    assert level_alike(Recursion(2.0), made(), PARTS, SCALE, 5, 0) == 1 / MOST_GAIN


def test_the_test_part_is_not_looked_at():
    plain, loud = made(), made()
    loud.signals[0, 3000:3500] *= 50
    gains = [level_alike(Recursion(0.35), each, PARTS, SCALE, 5, 0) for each in (plain, loud)]
    assert gains[0] == gains[1]


def test_a_free_run_begins_with_what_was_recorded_and_is_repeatable():
    one, same, other = (free_run(Recursion(0.4), made(), [(0, 400)], SCALE, 5, seed) for seed in (1, 1, 2))
    assert one.shape == (395,)
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_the_gain_is_part_of_the_file():
    spread = Spread()
    spread.log_gain.fill_(0.25)
    offsets = [step.offset for step, _ in pieces(spread, "") if step.do == "affine"]
    assert offsets == [pytest.approx(LEAST_LOG_SD + 0.25)]


def test_a_network_without_an_sd_is_left_as_it_is():
    assert level_alike(torch.nn.Linear(2, 1), made(), PARTS, SCALE, 5, 0) == 1.0

import numpy as np
import pytest

from palpate.devices.render.renderer import CROSS_MS, Renderer
from palpate.signals.textures.gate import RAMP
from palpate.signals.textures.voice import open_voice
from tests.devices.render.made import M, model


def constant(value):
    """A voice that always plays this."""
    return open_voice(model(weights=np.zeros(M), outputs=1, bias=value, rms_m_s2=10.0, peak_m_s2=100.0), seed=0)


class Loudest:
    """Plays its peak."""

    def __init__(self, peak):
        self.peak = peak

    def begin(self):
        """Nothing to forget."""

    join = begin

    def step(self, _speed, _force):
        return self.peak


def felt(renderer, count, speed=100.0, force=1.0):
    return np.array([renderer.step(speed, force) for _ in range(count)])


def test_voices_are_crossed_with_equal_power_and_the_new_one_has_no_ramp_of_its_own():
    renderer = Renderer(constant(1.0))
    felt(renderer, 50)
    renderer.switch(constant(-0.5))
    place = np.arange(1, CROSS_MS + 1) * np.pi / (2 * CROSS_MS)
    np.testing.assert_allclose(felt(renderer, CROSS_MS), np.cos(place) - 0.5 * np.sin(place), atol=1e-12)
    np.testing.assert_allclose(felt(renderer, 5), -0.5)


class Noise(Loudest):
    """Plays white noise of level 1."""

    def __init__(self, seed):
        super().__init__(100.0)
        self.samples = iter(np.random.default_rng(seed).standard_normal(100).tolist())

    def step(self, _speed, _force):
        return next(self.samples)


def test_the_level_of_two_textures_does_not_dip_or_swell():
    samples = []
    for seed in range(2000):
        renderer = Renderer(Noise(seed))
        renderer.switch(Noise(seed + 5000))
        samples.append(felt(renderer, CROSS_MS))
    assert np.std(samples, axis=0) == pytest.approx(np.ones(CROSS_MS), abs=0.07)


def test_the_last_of_several_wishes_is_played_and_silence_is_one():
    renderer = Renderer(constant(1.0))
    felt(renderer, 50)
    for value in (2.0, 3.0, 4.0):
        renderer.switch(constant(value))
        renderer.step(100.0, 1.0)
    np.testing.assert_allclose(felt(renderer, 2 * CROSS_MS)[-1:], 4.0)
    renderer.switch(None)
    assert not felt(renderer, CROSS_MS + 5)[CROSS_MS:].any()
    assert renderer.switches == 3
    assert renderer.voice is None


def test_a_switch_at_rest_makes_no_sound():
    renderer = Renderer(constant(1.0))
    felt(renderer, 30, 0.0, 0.0)
    renderer.switch(constant(2.0))
    assert not felt(renderer, 50, 0.0, 0.0).any()
    assert felt(renderer, 1)[0] == pytest.approx(2.0 * (0.5 - 0.5 * np.cos(np.pi / RAMP)))


def test_a_sum_of_two_voices_is_within_the_larger_peak():
    renderer = Renderer(Loudest(2.0))
    renderer.switch(Loudest(2.2))
    mixed = felt(renderer, CROSS_MS)
    assert mixed.max() == 2.2
    assert mixed[0] == pytest.approx(2.2 * np.sin(np.pi / 2 / CROSS_MS) + 2 * np.cos(np.pi / 2 / CROSS_MS))


def test_a_voice_that_comes_back_begins_anew():
    first, second = constant(1.0), constant(2.0)
    renderer = Renderer(first)
    for voice in (second, first, second, first):
        renderer.switch(voice)
        felt(renderer, CROSS_MS + 1)
    np.testing.assert_allclose(felt(renderer, 3), 1.0)

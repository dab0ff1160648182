import numpy as np
import pytest

from palpate.modeling.textures.metrics import correlation, cycle, envelope, greatest_ratio, slow
from palpate.modeling.textures.recording import TextureDataError
from tests.modeling.textures.made_textures import vibration

T = np.arange(20_000) / 1000


def test_an_envelope_follows_what_a_vibration_is_multiplied_by():
    shape = 1 + 0.8 * np.sin(2 * np.pi * 0.4 * T)
    found = envelope(vibration(len(T)) * shape)
    assert len(found) == 80  # of 250 ms
    assert correlation(found, slow(shape)) > 0.95


def test_a_correlation_with_what_does_not_vary_is_none():
    rising = np.arange(10.0)
    assert correlation(rising, rising) == pytest.approx(1.0)
    assert correlation(rising, np.full(10, 1e9)) is None
    assert correlation(rising, 1e9 + 1e-3 * np.sin(rising)) is None
    assert correlation(rising[:2], rising[:2]) is None
    with pytest.raises(TextureDataError):
        correlation(rising, rising[1:])


def test_noise_does_not_repeat_itself_and_a_limit_cycle_does():
    assert cycle(vibration(len(T))) < 0.3
    assert cycle(np.sin(2 * np.pi * 93 * T)) == pytest.approx(1.0, abs=0.01)


def test_a_limit_cycle_is_seen_where_its_frequency_moves_and_under_noise():
    moving = np.sin(2 * np.pi * (90 * T + 0.3 * np.sin(2 * np.pi * 0.1 * T)))
    assert cycle(moving) > 0.9
    assert cycle(moving + 0.3 * np.random.default_rng(0).standard_normal(len(T))) > 0.7


def test_a_cycle_between_rests_is_one():
    sounding = (T % 6) < 3
    assert cycle(np.where(sounding, np.sin(2 * np.pi * 93 * T), 0.0)) > 0.9


def test_silence_and_short_signals_have_no_cycle():
    assert cycle(np.zeros(5000)) is None
    assert cycle(vibration(800)) is None
    assert cycle(np.empty(0)) is None
    assert cycle(vibration(1000)) is not None


def test_what_is_no_number_is_infinitely_great():
    assert greatest_ratio(np.array([1.0, -4.0]), np.array([2.0, 1.0])) == 2
    assert greatest_ratio(np.array([np.nan]), np.ones(1)) == float("inf")
    assert greatest_ratio(np.ones(1), np.zeros(1)) is None

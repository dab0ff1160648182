from itertools import count
from time import perf_counter_ns

import numpy as np
import pytest

from palpate.signals.models.runtime import Model
from palpate.signals.textures.sounds import RenderError
from palpate.signals.textures.timing import recorded_inputs, step_us
from palpate.signals.textures.voice import play
from tests.devices.render.made import M, model, spectra, write


def test_steps_are_timed_by_the_clock_and_their_error_is_that_of_single_precision():
    texture = model()
    single = Model(texture.card, {name: tensor.astype(np.float32) for name, tensor in texture.tensors.items()})
    ticks = count(0, 5000)
    timing = step_us(single, 200, lambda: next(ticks))
    for median, p99, error in timing.values():
        assert median == p99 == 5.0
        assert 0 < error < 1e-6


def test_inputs_are_those_that_occur_while_it_runs():
    given = recorded_inputs(model(), 500)
    assert given.shape == (500, 3 * M)
    np.testing.assert_array_equal(given[1:, : M - 1], given[:-1, 1:M])
    assert np.ptp(given[:, 2 * M - 1]) > 50
    assert recorded_inputs(spectra(), 20).shape == (20, 3)


def test_a_card_is_played_the_same_each_time_and_its_steps_are_timed(tmp_path):
    card = write(tmp_path, model())
    played = play(card, np.full(200, 100.0), np.ones(200), seed=1)
    assert played.tobytes() == play(card, np.full(200, 100.0), np.ones(200), seed=1).tobytes()
    assert "NumPy" in step_us(card, 20, perf_counter_ns)
    with pytest.raises(RenderError, match=r"10 at least"):
        step_us(card, 3, perf_counter_ns)

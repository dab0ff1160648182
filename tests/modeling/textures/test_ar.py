"""Piecewise autoregression finds what a process was made of, is stable everywhere, and as loud as what it learned."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from palpate.modeling.files.model_files import Exported, write_model
from palpate.modeling.textures.ar import AR, RADIUS, STEP, fit, segmented
from palpate.modeling.textures.methods import Learning
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from palpate.signals.linear_prediction import (
    burg,
    filters_of,
    frequencies_of,
    power_gain,
    stable_within,
)
from palpate.signals.models.card import Port
from palpate.signals.models.file import read_model

SECONDS = 12
COUNT = 1000 * SECONDS


def drawn(seed):
    return np.random.Generator(np.random.PCG64(seed))


def hand(count, seed):
    """Speed in mm/s and force in N of a hand that goes to and fro, pressing now more, now less."""
    t = np.arange(count) / 1000 + 10 * drawn(seed).random(2)[:, None]
    speed = 80 + 55 * np.sin(2 * np.pi * 0.41 * t[0])
    force = 1.2 + 0.8 * np.sin(2 * np.pi * 0.173 * t[1])
    return speed, force


def process(speed, force, seed):
    """A resonance that rises with speed (60 to 250 Hz) and a level that rises with force and speed."""
    angle = 2 * np.pi * (40 + 1.5 * speed) / 1000
    innovations = drawn(seed).normal(size=len(speed)) * 0.02 * speed * np.sqrt(force)
    signal = np.zeros(len(speed) + 2)
    for n in range(len(speed)):
        signal[n + 2] = 2 * 0.93 * np.cos(angle[n]) * signal[n + 1] - 0.93**2 * signal[n] + innovations[n]
    return signal[2:]


def learning(signals, stretches=None, **others):
    count = signals.shape[1]
    parts = Parts(tuple(stretches or ((0, count * 8 // 10),)), ((count * 8 // 10, count * 9 // 10),), ())
    return Learning(Recording("a", "A", signals), parts, **others)


@pytest.fixture(scope="module")
def fitted():
    speed, force = hand(COUNT, 1)
    return fit(learning(np.stack([process(speed, force, 2), speed, force]), window=10))


def freely(fitted, speed, force, seed):
    """What runs on its own output, by the model's own equations."""
    filters = fitted.filters(speed, force)
    sd = np.exp(fitted.mesh.shares(np.stack([speed, force], axis=1)) @ fitted.log_sd)
    noise = drawn(seed).normal(size=len(speed)) * sd
    order = filters.shape[1] - 1
    weights = -filters[:, :0:-1]
    signal = np.zeros(len(speed) + order)
    for n in range(len(speed)):
        signal[n + order] = weights[n] @ signal[n : n + order] + noise[n]
    return signal[order:]


def test_free_running_it_is_as_loud_as_the_process_wherever_the_hand_is(fitted):
    speed, force = hand(20_000, 7)
    truth, played = process(speed, force, 8), freely(fitted, speed, force, 9)
    assert played.std() / truth.std() == pytest.approx(1, abs=0.08)
    power = [np.sqrt(np.convolve(x**2, np.ones(200) / 200, "same")) for x in (truth, played)]
    assert np.corrcoef(*power)[0, 1] > 0.85
    for slow in (speed < 60, speed > 110):
        assert played[slow].std() / truth[slow].std() == pytest.approx(1, abs=0.15)


def test_the_resonance_follows_speed(fitted):
    for speed in (45.0, 80.0, 115.0):
        poles = np.roots(fitted.filters(np.array([speed]), np.array([1.2]))[0])
        strongest = np.angle(poles[np.abs(poles).argmax()])
        assert abs(abs(strongest) * 1000 / 2 / np.pi - (40 + 1.5 * speed)) < 20


def tensors_in(fitted, dtype):
    exported = fitted.exported()
    tensors = {
        name: tensor.astype(dtype) if tensor.dtype.kind == "f" else tensor for name, tensor in exported.tensors.items()
    }
    return Exported(exported.steps, tensors)


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.float16])
def test_what_runs_is_stable_for_every_speed_and_force(fitted, dtype):
    tensors = tensors_in(fitted, dtype).tensors
    line = np.linspace(-20, 200, 60), np.linspace(-0.5, 3.5, 60)
    grid = np.stack(np.meshgrid(*line), axis=-1).reshape(-1, 2)
    random = drawn(3).uniform([-100, -2], [400, 6], size=(3000, 2))
    shares = fitted.mesh.shares(np.concatenate([grid, random]))
    filters = filters_of(shares @ tensors["frequencies"].astype(float))
    assert (np.diff(shares @ tensors["frequencies"].astype(float), axis=1) > 0).all()
    filters[:, 1:] *= tensors["damping"].astype(float)[0, ::-1][: filters.shape[1] - 1]
    assert stable_within(filters, 0.999).all()
    worst = max(np.abs(np.roots(row)).max() for row in filters[::50])
    assert worst < (0.999 if dtype is np.float16 else RADIUS + 1e-6)


def test_the_file_answers_as_the_model(fitted, tmp_path):
    takes, gives = Port(kind="texture_window", size=30, unit=""), Port(kind="acceleration", size=2, unit="m/s^2")
    given = drawn(4).normal(size=(300, 3, 10)) * 3
    given[:, 1], given[:, 2] = drawn(5).uniform(-50, 300, (300, 1)), drawn(6).uniform(-1, 4, (300, 1))
    log_sd = fitted.mesh.shares(given[:, 1:, -1]) @ fitted.log_sd
    for dtype, near in ((np.float64, 1e-11), (np.float32, 1e-4)):
        exported = tensors_in(fitted, dtype)
        card = write_model(tmp_path, "ar", exported, title="", method="ar", takes=takes, gives=gives)
        output = read_model(card).run(given.reshape(300, -1))
        np.testing.assert_allclose(output[:, 0], fitted.predict(given), rtol=0, atol=near)
        np.testing.assert_allclose(output[:, 1], log_sd, rtol=0, atol=near)
    with pytest.raises(TextureDataError, match=r"\(n, 3, 10\) are expected"):
        fitted.predict(given[:, :, :9])
    given[3, 1, 2] = np.nan
    with pytest.raises(TextureDataError, match="not finite"):
        fitted.predict(given)


def test_the_same_recording_gives_the_same_model():
    speed, force = hand(4000, 1)
    signals = np.stack([process(speed, force, 2), speed, force])
    one, other = (fit(learning(signals, window=8)) for _ in range(2))
    assert np.array_equal(one.frequencies, other.frequencies)
    assert np.array_equal(one.log_sd, other.log_sd)


def test_a_recording_is_cut_where_its_spectrum_or_its_level_changes():
    noise = drawn(1).normal(size=6000)
    first, second = lfilter([1], [1, -1.2, 0.8], noise[:2000]), lfilter([1], [1, 1.1, 0.7], noise[2000:4000])
    borders = [segment.start for segment in segmented(np.concatenate([first, second, noise[4000:] * 9]), [(0, 6000)])]
    assert len(borders) <= 4
    for expected in (0, 2000, 4000):
        assert min(abs(border - expected) for border in borders) <= 2 * STEP
    assert len(segmented(noise[:3000], [(0, 3000)])) == 2  # no stretch is longer than 2 s, and nothing else is cut


def test_burg_finds_the_process_from_many_short_stretches_of_it():
    true = np.poly([0.9 * np.exp(0.7j), 0.9 * np.exp(-0.7j), 0.8j, -0.8j]).real
    stretches = [lfilter([1], true, drawn(seed).normal(size=400))[100:] for seed in range(60)]
    weights, error = burg(stretches, 4)
    np.testing.assert_allclose(weights, true, atol=0.03)
    assert error == pytest.approx(1, abs=0.05)
    np.testing.assert_allclose(filters_of(frequencies_of(weights)[None])[0], weights, atol=1e-12)
    response = lfilter([1], weights, np.eye(1, 4000)[0])
    assert power_gain(weights[None])[0] == pytest.approx(response @ response, rel=1e-9)


def test_a_short_recording_with_a_hand_that_never_varies_has_one_point():
    speed, force = np.full(1900, 60.0), np.full(1900, 1.0)
    signals = np.stack([process(speed, force, 3), speed, force])
    model = fit(learning(signals))
    assert len(model.log_sd) == 1
    assert model.frequencies.shape == (1, 30)
    played = freely(model, np.full(8000, 60.0), np.full(8000, 1.0), 1)
    assert played.std() / signals[0].std() == pytest.approx(1, abs=0.12)
    assert np.isfinite(model.predict(np.tile(signals[None, :, :30], (2, 1, 1)))).all()


@pytest.mark.parametrize("what", ["speed", "force"])
def test_a_hand_that_varies_in_one_way_only_has_points_on_a_line(what):
    speed, force = hand(6000, 1)
    force = np.full(6000, 1.0) if what == "speed" else force
    speed = np.full(6000, 70.0) if what == "force" else speed
    model = fit(learning(np.stack([process(speed, force, 2), speed, force]), window=8))
    assert (model.mesh.triangles[:, 1] == model.mesh.triangles[:, 2]).all()
    assert stable_within(model.filters(np.linspace(-50, 300, 500), np.linspace(-1, 5, 500)), 0.999).all()


@pytest.mark.parametrize("change", ["half silent", "clipped", "spike", "loud", "quiet", "offset", "hum", "square"])
def test_odd_recordings_get_finite_stable_weights(change):
    speed, force = hand(4000, 1)
    samples = process(speed, force, 2)
    samples = {
        "half silent": np.where(np.arange(4000) < 2000, 0.0, samples), "clipped": np.clip(samples, -0.5, 0.5),
        "spike": np.where(np.arange(4000) == 900, 1e6, samples), "loud": samples * 1e12, "quiet": samples * 1e-12,
        "offset": samples + 1e6, "hum": np.sin(2 * np.pi * 0.05 * np.arange(4000)),
        "square": np.sign(np.sin(2 * np.pi * 0.013 * np.arange(4000))),
    }[change]  # fmt: skip
    model = fit(learning(np.stack([samples, speed, force])))
    assert np.isfinite(model.frequencies).all()
    assert np.isfinite(model.log_sd).all()
    assert stable_within(model.filters(np.linspace(-50, 300, 500), np.linspace(-1, 5, 500)), 0.999).all()
    assert np.isfinite(freely(model, *hand(2000, 4), 5)).all()


@pytest.mark.parametrize(
    ("samples", "stretches", "words"),
    [
        (np.zeros(2000), None, "is 0 m/s.2 throughout"),
        (np.full(2000, 9.81), None, "is 9.81 m/s.2 throughout"),
        (np.ones(3), ((0, 1),), "1 sample to learn from; 20 at least"),
        (drawn(1).normal(size=100), ((0, 19),), "19 samples to learn from"),
        (drawn(1).normal(size=100), ((5, 5),), "0 samples to learn from"),
    ],
)
def test_what_nothing_can_be_learned_from_is_refused(samples, stretches, words):
    signals = np.stack([samples, np.full(len(samples), 50.0), np.ones(len(samples))])
    with pytest.raises(TextureDataError, match=words):
        fit(learning(signals, stretches))


def test_the_method_is_sampled_and_names_its_source():
    assert (AR.name, AR.kind, AR.sampled) == ("ar", "next", True)
    assert "Culbertson" in AR.source

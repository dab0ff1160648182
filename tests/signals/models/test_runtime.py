"""Every step answers what its definition says, one input at a time or many, and never an answer that is none."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from palpate.signals.doors.limits import bounded
from palpate.signals.doors.model_features import features
from palpate.signals.models.card import (
    Activation,
    Affine,
    Clip,
    Conv,
    Dense,
    DoorFeatures,
    Forest,
    Kernel,
    MaxPool,
    Mean,
    Nearest,
    Playable,
    Reshape,
    Residual,
    Upsample,
)
from palpate.signals.models.file import read_model
from palpate.signals.models.runtime import ModelInputError
from tests.signals.models.cards import FORCE, feeling, port, saved

RANDOM = np.random.Generator(np.random.PCG64(7))
X = RANDOM.normal(size=(19, 12)) * 10


def run(folder, steps, tensors, takes, gives, given):
    return read_model(saved(folder, steps, tensors, takes, gives)).run(given)


def correlated(x, weight, bias, pad):
    """The definition, element by element: (channels, length) to (filters, length)."""
    padded = np.pad(x, ((0, 0), (pad, pad)))
    width = weight.shape[2]
    places = range(padded.shape[1] - width + 1)
    return np.array(
        [[np.sum(w * padded[:, t : t + width]) + b for t in places] for w, b in zip(weight, bias, strict=True)]
    )


def test_a_network_of_all_layers_is_what_its_definitions_say(tmp_path):
    tensors = {
        "w1": RANDOM.normal(size=(3, 2, 3)), "b1": RANDOM.normal(size=3), "w2": RANDOM.normal(size=(3, 3, 3)),
        "b2": RANDOM.normal(size=3), "gain": RANDOM.normal(size=(3, 1)), "shift": RANDOM.normal(size=(3, 6)),
        "w3": RANDOM.normal(size=(4, 18)), "b3": RANDOM.normal(size=4), "w4": RANDOM.normal(size=(2, 4)),
        "b4": RANDOM.normal(size=2),
    }  # fmt: skip
    steps = (
        Affine(gain=0.1, offset=1.0), Reshape(shape=(2, 6)), Conv(weight="w1", bias="b1", pad=1),
        Activation(function="tanh"), Residual(steps=(Conv(weight="w2", bias="b2", pad=1),)),
        Affine(gain="gain", offset="shift"), MaxPool(size=2), Upsample(times=2), Dense(weight="w3", bias="b3"),
        Activation(function="relu"), Dense(weight="w4", bias="b4"), Clip(low=-3.0, high=3.0),
    )  # fmt: skip
    expected = []
    for x in X:
        y = np.tanh(correlated((0.1 * x + 1).reshape(2, 6), tensors["w1"], tensors["b1"], 1))
        y = np.maximum(y + correlated(y, tensors["w2"], tensors["b2"], 1), 0)
        y = y * tensors["gain"] + tensors["shift"]
        y = np.repeat(np.maximum(y[:, 0::2], y[:, 1::2]), 2, axis=1).reshape(-1)
        y = np.maximum(tensors["w3"] @ y + tensors["b3"], 0)
        expected.append(np.clip(tensors["w4"] @ y + tensors["b4"], -3, 3))
    model = read_model(saved(tmp_path, steps, tensors, port(12), port(2)))
    before = X.copy()
    np.testing.assert_allclose(model.run(X), expected, rtol=0, atol=1e-11)
    np.testing.assert_allclose([model.run(x) for x in X], expected, rtol=0, atol=1e-11)
    assert np.array_equal(before, X)


@pytest.mark.parametrize(("size", "length", "width", "pad"), [(3, 11, 2, 0), (5, 13, 5, 3), (2, 4, 1, 0)])
def test_any_width_padding_and_pool(tmp_path, size, length, width, pad):
    weight, bias = RANDOM.normal(size=(2, 1, width)), RANDOM.normal(size=2)
    x = RANDOM.normal(size=length)
    y = correlated(x[None], weight, bias, pad)
    pooled = y[:, : y.shape[1] // size * size].reshape(2, -1, size).max(axis=2).reshape(-1)
    pool, flat = MaxPool(size=size), Reshape(shape=(pooled.size,))
    steps = (Reshape(shape=(1, length)), Conv(weight="w", bias="b", pad=pad), pool, flat)
    output = run(tmp_path, steps, {"w": weight, "b": bias}, port(length), port(pooled.size), x)
    np.testing.assert_allclose(output, pooled, rtol=0, atol=1e-12)


def test_counted_copies_of_a_dense_layer_equal_made_copies(tmp_path):
    tensors = {"w": RANDOM.normal(size=(3, 36)), "b": RANDOM.normal(size=3)}
    steps = (Reshape(shape=(2, 6)), Upsample(times=3), Dense(weight="w", bias="b"))
    apart = (*steps[:2], Affine(), steps[2])
    counted = run(tmp_path / "a", steps, tensors, port(12), port(3), X)
    spelled_out = run(tmp_path / "b", apart, tensors, port(12), port(3), X)
    np.testing.assert_allclose(counted, spelled_out, rtol=0, atol=1e-11)


def test_a_kernel_is_the_mean_of_a_gaussian_process_also_far_from_zero(tmp_path):
    points, weights = RANDOM.normal(size=(5, 3)), RANDOM.normal(size=(5, 2))
    x = RANDOM.normal(size=(4, 3))
    near = 2.5 * np.exp(-((x[:, None] - points) ** 2).sum(-1) / (2 * 1.5**2))
    step = Kernel(points="p", weights="w", length=1.5, variance=2.5)
    output = run(tmp_path / "a", (step,), {"p": points, "w": weights}, port(3), port(2), x)
    np.testing.assert_allclose(output, near @ weights, rtol=1e-12)
    far = run(tmp_path / "b", (step,), {"p": points + 2**20, "w": weights}, port(3), port(2), x + 2**20)
    np.testing.assert_allclose(far, near @ weights, rtol=1e-7)


def test_the_nearest_example_is_the_first_of_equals(tmp_path):
    tensors = {"p": np.array([[0.0], [2.0], [2.0], [9.0]]), "v": np.array([[1.0], [2.0], [3.0], [4.0]])}
    given = np.array([[-5.0], [1.0], [1.1], [100.0]])
    output = run(tmp_path, (Nearest(points="p", values="v"),), tensors, port(1), port(1), given)
    assert output.ravel().tolist() == [1.0, 1.0, 2.0, 4.0]


FOREST = {
    "roots": np.array([0, 5]),
    "feature": np.array([0, 1, -1, -1, -1, -1]),
    "threshold": np.array([0.1, 5.0, 0, 0, 0, 0], dtype=np.float32),
    "left": np.array([1, 2, -1, -1, -1, -1]),
    "right": np.array([4, 3, -1, -1, -1, -1]),
    "value": np.array([[0.0], [0.0], [1.0], [2.0], [3.0], [10.0]]),
}
FOREST_STEP = Forest(**{name: name for name in FOREST})


def test_a_forest_goes_left_where_the_input_is_not_greater_in_the_thresholds_precision(tmp_path):
    given = np.array([[0.0, 5.0], [0.0, 5.1], [0.2, 0.0], [0.1, 0.0], [np.float64(np.float32(0.1)) + 1e-12, 0.0]])
    output = run(tmp_path, (FOREST_STEP,), FOREST, port(2), port(1), given)
    assert output.ravel().tolist() == [5.5, 6.0, 6.5, 5.5, 5.5]


def test_the_mean_of_members_and_a_residual_of_nothing_leave_the_input_alone(tmp_path):
    members = ((Residual(steps=()),), (Activation(function="relu"), Affine(gain=3.0)), (Clip(low=0, high=1),))
    given = np.array([[-1.0, 2.0]])
    output = run(tmp_path, (Mean(members=members),), {}, port(2), port(2), given)
    np.testing.assert_allclose(output, [[0.0, (4.0 + 6.0 + 1.0) / 3]])
    assert given.tolist() == [[-1.0, 2.0]]


def test_profiles_steps_are_those_of_the_rig(tmp_path):
    force = RANDOM.normal(size=(3, 621)) * 30
    names = ("max_force_N", "work_J_m", "first_peak_deg")
    output = run(tmp_path / "a", (DoorFeatures(names=names),), {}, FORCE, port(3), force)
    assert np.array_equal(output, features(force, names))
    playable = run(tmp_path / "b", (Playable(force_N=20.0, slope_N_deg=30.0),), {}, FORCE, FORCE, force)
    assert np.array_equal(playable, [bounded(row, 20.0, 30.0) for row in force])
    assert np.abs(playable).max() <= 20
    assert np.abs(np.diff(playable, axis=1)).max() <= 3 + 1e-12


def test_one_input_gives_one_answer_and_none_gives_none(tmp_path):
    model = read_model(feeling(tmp_path))
    one = model.run(np.linspace(0, 30, 621))
    assert (one.shape, one.dtype) == ((2,), np.float64)
    assert one == pytest.approx([30, 80])
    assert model.run(np.empty((0, 621))).shape == (0, 2)
    assert model.run(np.full(621, 7, dtype=np.float16)) == pytest.approx([7, 64])
    assert model.run([7] * 621) == pytest.approx([7, 64])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (np.zeros(620), r"621 numbers .* found an array of shape \(620,\)"),
        (np.zeros((2, 622)), r"found an array of shape \(2, 622\)"),
        (np.zeros((1, 1, 621)), "621 numbers"),
        (5.0, r"shape \(\)"),
        (["1"] * 621, "real numbers are expected, found list of <U1"),
        ([None] * 621, "real numbers are expected, found list of object"),
        (np.full(621, 1 + 2j), "real numbers are expected, found ndarray of complex128"),
        (np.full(621, np.datetime64("2020-01-01")), "real numbers are expected"),
        ([[1.0] * 621, [1.0] * 620], "rows of one length are expected"),
        (np.full(621, np.longdouble(2) ** 2000), "row 1 holds inf at place 1"),
        (np.where(np.arange(621) == 3, np.nan, 1.0), "row 1 holds nan at place 4"),
        (np.full((2, 621), np.inf), "row 1 holds inf at place 1"),
    ],
)
def test_an_input_that_is_none_is_refused(tmp_path, given, words):
    with pytest.raises(ModelInputError, match=words):
        read_model(feeling(tmp_path)).run(given)


def test_what_lies_beyond_what_the_card_says_is_refused_in_a_batch_too(tmp_path):
    takes = FORCE.model_copy(update={"within": (-600.0, 600.0)})
    model = read_model(saved(tmp_path, (DoorFeatures(names=("max_force_N",)),), {}, takes, port(1)))
    force = np.zeros((2, 621))
    force[1, 300] = 600.0
    assert model.run(force).ravel().tolist() == [0.0, 600.0]
    for beyond in (np.nextafter(600.0, 700.0), -600.5, 1e6):
        force[1, 300] = beyond
        with pytest.raises(ModelInputError, match=r"row 2 holds .* N at place 301; the model answers to -600 to 600"):
            model.run(force)


@pytest.mark.parametrize("value", [1e6, -1e6, 1e39, 1e300])
@pytest.mark.parametrize("kind", ["network", "kernel", "nearest", "forest", "features", "bounded"])
def test_a_spike_gets_a_finite_answer_or_a_refusal_never_a_silent_one(tmp_path, kind, value):
    small = {"p": RANDOM.normal(size=(4, 621)).astype(np.float32), "v": np.ones((4, 1), dtype=np.float32)}
    steps, tensors, gives = {
        "network": ((Reshape(shape=(1, 621)), Conv(weight="w", bias="b"), Dense(weight="d", bias="b")), {
            "w": np.array([[[1.0, -1.0]]], dtype=np.float32), "b": np.zeros(1, dtype=np.float32),
            "d": np.ones((1, 620), dtype=np.float32)}, port(1)),
        "kernel": ((Kernel(points="p", weights="v", length=1.0),), small, port(1)),
        "nearest": ((Nearest(points="p", values="v"),), small, port(1)),
        "forest": ((FOREST_STEP,), FOREST, port(1)),
        "features": ((DoorFeatures(names=("max_force_N",)),), {}, port(1)),
        "bounded": ((Affine(gain=1e200), Affine(gain=1e200), Playable(force_N=60, slope_N_deg=60)), {}, FORCE),
    }[kind]  # fmt: skip
    spike = np.zeros(621)
    spike[300] = value
    try:
        answer = run(tmp_path, steps, tensors, FORCE, gives, spike)
    except ModelInputError as refused:
        assert abs(value) > 1e38 or kind == "bounded"
        assert "1e+" in str(refused)
        return
    assert np.isfinite(answer).all()
    assert kind in ("forest", "network", "kernel", "nearest", "features")
    assert abs(value) == 1e6 or kind == "forest"


def test_many_threads_may_ask_one_model(tmp_path):
    model = read_model(feeling(tmp_path))
    force = RANDOM.normal(size=(40, 621))
    with ThreadPoolExecutor(4) as pool:
        assert np.array_equal(list(pool.map(model.run, force)), [model.run(row) for row in force])


def test_a_model_pickles_as_its_card_and_numbers(tmp_path):
    model = read_model(feeling(tmp_path))
    copy = pickle.loads(pickle.dumps(model))
    assert copy.card == model.card
    assert np.array_equal(copy.run(np.arange(621.0)), model.run(np.arange(621.0)))

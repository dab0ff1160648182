"""The compiled kernel answers what NumPy answers, on every instruction set that this processor has."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import numpy.linalg._umath_linalg as math_library
import pytest
from scipy.spatial import Delaunay

from devices.models import specimens
from devices.models.errors import ModelInputError
from devices.models.fastest import ByNumpy, fastest
from devices.models.native import library as libraries
from devices.models.native.library import InstructionSet, KernelMissing, Library, library, opened
from devices.models.native.opened import Native
from devices.models.native.packing import halves, packed
from devices.models.native.values import NotCompiled
from devices.models.runtime import Model
from protocols.model_card import Activation, Affine, Dense, Kernel, Port, Reshape
from protocols.signal_steps import Attention, Autoregression
from tests.devices.models.native.random_cards import card_of, random_model

FUNCTIONS = ("relu", "tanh", "sigmoid", "gelu", "elu", "leaky", "softplus", "exp", "log", "square", "abs")
SINGLE = float(np.finfo(np.float32).eps)


@pytest.fixture(scope="module")
def kernel() -> Library:
    try:
        return library()
    except KernelMissing as missing:
        pytest.skip(f"{missing}")


def doubled(model: Model) -> Model:
    """The same model in double precision: the reference."""
    reals = {name: each.astype(np.float64) if each.dtype.kind == "f" else each for name, each in model.tensors.items()}
    return Model(model.card, reals)


def each_set(model: Model, kernel: Library) -> list[Native]:
    return [Native(model, kernel, instructions) for instructions in kernel.sets]


def chance(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


@pytest.mark.parametrize("block", range(8))
def test_random_cards_of_every_operation(kernel, block):
    for seed in range(block * 15, block * 15 + 15):
        model = random_model(seed, 4 + seed % 14)
        given = chance(seed).standard_normal((4, model.card.takes.size))
        wanted, rough = doubled(model).run(given), model.run(given)
        scale = max(float(np.abs(wanted).max()), 1e-3)
        allowed = 1e-5 * scale + 30 * float(np.abs(rough - wanted).max())
        for native in each_set(model, kernel):
            answers = native.run(given)
            assert np.abs(answers - wanted).max() <= allowed, (seed, native.runtime)
            assert np.array_equal(answers, [native.run(row) for row in given]), (seed, native.runtime)


def test_foten_is_as_near_the_reference_as_single_precision_can_be(kernel):
    model = specimens.foten()
    assert specimens.parameters(model) == 471_235
    given = specimens.windows(100)
    wanted = doubled(model).run(given)
    for native in each_set(model, kernel):
        assert np.abs(native.run(given) - wanted).max() <= 1e-6 * specimens.SPREAD[0], native.runtime


def test_weights_that_were_stored_in_half_precision_are_run_so_and_exactly(kernel):
    model = specimens.foten(3)
    stored = Model(
        model.card, {name: each.astype(np.float16).astype(np.float32) for name, each in model.tensors.items()}
    )
    given = specimens.windows(20)
    for native in each_set(stored, kernel):
        assert np.abs(native.run(given) - doubled(stored).run(given)).max() <= 1e-6 * specimens.SPREAD[0]
    some = np.array([[1.5, -2.25], [2.0**-14, 65504.0]])
    assert halves(some) and not halves(some + 1e-4) and not halves(some * 2)
    instructions = InstructionSet(0, "x", 4)
    assert np.array_equal(packed(some, instructions, half=True).view(np.float16).reshape(2, 4)[:, :2], some)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_within_a_few_units_of_the_last_place(kernel, name):
    given = np.concatenate([np.linspace(-30, 30, 4001), np.geomspace(1e-6, 80, 500), -np.geomspace(1e-6, 80, 500)])
    given = given.astype(np.float32).astype(np.float64)
    model = Model(card_of((Activation(function=name),), len(given), len(given)), {})
    wanted = model.run(given)
    for native in each_set(model, kernel):
        far = np.abs(native.run(given) - wanted)
        assert (far <= 3 * SINGLE * np.maximum(np.abs(wanted), 0.5 if name != "exp" else 0)).all(), native.runtime


def test_an_autoregression_is_computed_in_double_precision(kernel):
    for order, points in ((20, 12), (7, 5), (40, 2), (1, 1)):
        model, given = predictor(order, points)
        wanted = model.run(given)
        for native in each_set(model, kernel):
            np.testing.assert_allclose(native.run(given), wanted, rtol=1e-10, atol=1e-10)


def predictor(order: int, points: int) -> tuple[Model, np.ndarray]:
    draw = chance(order)
    places = draw.uniform(0.2, 2.5, (points, 2))
    triangles = Delaunay(places).simplices if points > 2 else np.array([[0, points - 1, points - 1]])
    gaps = draw.uniform(0.3, 1.5, (points, order + 1))
    rising = np.cumsum(gaps, axis=1)[:, :-1] / gaps.sum(axis=1, keepdims=True) * np.pi
    tensors = {"p": places, "f": rising, "s": draw.standard_normal(points), "t": triangles.astype(np.int64)}
    step = Autoregression(points="p", frequencies="f", log_sd="s", triangles="t")
    given = draw.standard_normal((60, 3, 40))
    given[:, 1], given[:, 2] = draw.uniform(-10, 350, (60, 1)), draw.uniform(-0.5, 4, (60, 1))
    return Model(card_of((Reshape(shape=(3, 40)), step), 120, 2), tensors), given.reshape(60, -1)


@pytest.mark.parametrize("causal", [False, True])
def test_sparse_attention_chooses_as_numpy_does(kernel, causal):
    draw, width, length = chance(5), 16, 21
    sides = {"e": (width * length, 30), "eb": (width * length,), "w": (3 * width, width), "b": (3 * width,)}
    sides |= {"o": (width, width), "ob": (width,)}
    tensors = {name: (draw.standard_normal(shape) / 4).astype(np.float32) for name, shape in sides.items()}
    step = Attention(heads=4, weight="w", bias="b", out="o", out_bias="ob", sparse=6, causal=causal)
    steps = (Dense(weight="e", bias="eb"), Reshape(shape=(width, length)), step, Reshape(shape=(width * length,)))
    model, given = Model(card_of(steps, 30, width * length), tensors), draw.standard_normal((20, 30))
    wanted = doubled(model).run(given)
    for native in each_set(model, kernel):
        np.testing.assert_allclose(native.run(given), wanted, atol=1e-4 * np.abs(wanted).max())


def test_numbers_that_no_model_answers_are_refused_in_numpys_words(kernel):
    model = specimens.foten()
    native = Native(model, kernel, kernel.sets[0])
    good = specimens.windows(1)[0]
    before = native.run(good)
    for wrong in (np.nan, np.inf, -np.inf):
        bad = good.copy()
        bad[7] = wrong
        with pytest.raises(ModelInputError, match="holds .* at place 8"):
            native.run(bad)
    for shape in ((59,), (2, 61), (2, 2, 60), ()):
        with pytest.raises(ModelInputError, match="60 numbers"):
            native.run(np.zeros(shape))
    with pytest.raises(ModelInputError, match="row 2 holds nan"):
        native.run(np.array([good, np.full(60, np.nan)]))
    with pytest.raises(ModelInputError, match="no finite answer"):
        native.run(np.full(60, 1e200))
    assert np.array_equal(native.run(good), before)
    assert np.array_equal(native.run(good.tolist()), model.run(good))


def test_what_is_outside_the_cards_limits_is_refused(kernel):
    takes = Port(kind="texture_window", size=3, unit="-", within=(-1.0, 2.0))
    steps = (Dense(weight="w", bias="b"),)
    card = card_of(steps, 3, 1).model_copy(update={"takes": takes})
    model = Model(card, {"w": np.ones((1, 3), np.float32), "b": np.zeros(1, np.float32)})
    native = fastest(model)
    assert native.runtime.startswith("native")
    assert native.run(np.array([2.0, -1.0, 0.5])) == pytest.approx(1.5)
    with pytest.raises(ModelInputError, match="answers to"):
        native.run(np.array([2.1, 0.0, 0.0]))


def test_silence_spikes_and_numbers_near_zero_are_answered(kernel):
    model = specimens.foten()
    for native in each_set(model, kernel):
        for given in (np.zeros(60), np.full(60, 1e6), np.full(60, 1e-310), np.full(60, -1e-42)):
            assert native.run(given) == pytest.approx(model.run(given), rel=1e-3, abs=1e-3), native.runtime


def test_several_threads_may_share_one_model(kernel):
    native = Native(specimens.foten(), kernel, kernel.sets[0])
    given = specimens.windows(64)
    alone = native.run(given)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(native.run, given))
    assert np.array_equal(alone, together)


def test_a_model_pickles_and_answers_to_the_same_bits(kernel):
    native = fastest(specimens.foten())
    again = pickle.loads(pickle.dumps(native))
    given = specimens.windows(5)
    assert again.runtime == native.runtime
    assert np.array_equal(again.run(given), native.run(given))


def test_a_step_that_the_kernel_does_not_know_is_left_to_numpy(kernel):
    steps = (Kernel(points="p", weights="w", length=1.0),)
    model = Model(card_of(steps, 2, 1), {"p": np.ones((3, 2)), "w": np.ones((3, 1))})
    with pytest.raises(NotCompiled, match="the step kernel"):
        Native(model, kernel, kernel.sets[0])
    found = fastest(model)
    assert found == ByNumpy(model, "the step kernel")
    assert found.runtime == "NumPy" and found.run(np.ones(2)) == pytest.approx(model.run(np.ones(2)))


def test_without_a_kernel_numpy_runs_the_model_and_says_why(monkeypatch, tmp_path):
    def missing() -> Library:
        return opened(tmp_path / "_kernel.so")

    monkeypatch.setattr(libraries, "library", missing)
    model = specimens.foten()
    found = fastest(model)
    assert isinstance(found, ByNumpy) and "Install the package again" in found.why
    assert np.array_equal(found.run(specimens.windows(1)), model.run(specimens.windows(1)))


def test_a_file_that_is_no_kernel_is_refused(tmp_path):
    other = tmp_path / "other.so"
    other.write_bytes(b"no library")
    with pytest.raises(KernelMissing, match="cannot be loaded"):
        opened(other)
    with pytest.raises(KernelMissing, match="palpate_version"):
        opened(Path(math_library.__file__))


def test_an_instruction_set_that_is_not_there_is_not_used(kernel):
    found = fastest(specimens.foten(), "AVX-1024")
    assert isinstance(found, ByNumpy) and "AVX-1024" in found.why


def test_normalisation_is_done_in_double_precision(kernel):
    """A channel that hardly varies around a large value: in single precision its digits would be gone."""
    about, sd = 1e6, 1e-2
    steps = (Affine(gain=1 / sd, offset=-about / sd), Dense(weight="w", bias="b"))
    model = Model(card_of(steps, 4, 1), {"w": np.ones((1, 4)), "b": np.zeros(1)})
    given = about + sd * chance(2).standard_normal((10, 4))
    np.testing.assert_allclose(fastest(model).run(given), model.run(given), rtol=1e-5, atol=1e-6)
    assert fastest(model).runtime.startswith("native")

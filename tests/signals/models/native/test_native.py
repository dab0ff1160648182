"""The compiled kernel answers what NumPy answers, on every instruction set that this processor has."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.spatial import Delaunay

from benchmarks.synthesis import specimens
from palpate.signals.models.card import Activation, Affine, Conv, Dense, Reshape
from palpate.signals.models.card_steps import Attention, Autoregression, Part
from palpate.signals.models.fastest import fastest
from palpate.signals.models.native.draft import halves, packed
from palpate.signals.models.native.library import InstructionSet, Library
from palpate.signals.models.native.opened import Native
from palpate.signals.models.runtime import Model
from tests.signals.models.native.random_cards import card_of, random_model

pytestmark = pytest.mark.needs("compiler")

FUNCTIONS = ("relu", "tanh", "sigmoid", "gelu", "elu", "leaky", "softplus", "exp", "log", "square", "abs")
SINGLE = float(np.finfo(np.float32).eps)


def doubled(model: Model) -> Model:
    """The same model in double precision: the reference."""
    reals = {
        name: tensor.astype(np.float64) if tensor.dtype.kind == "f" else tensor
        for name, tensor in model.tensors.items()
    }
    return Model(model.card, reals)


def native_with_each_set(model: Model, kernel: Library) -> list[Native]:
    return [Native(model, kernel, instructions, fastest) for instructions in kernel.sets]


def chance(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


@pytest.mark.parametrize("block", range(8))
def test_random_cards_of_every_operation(kernel, block):
    for seed in range(block * 15, block * 15 + 15):
        model = random_model(seed, 4 + seed % 14)
        given = chance(seed).standard_normal((4, model.card.takes.size))
        exact, rough = doubled(model).run(given), model.run(given)
        scale = max(float(np.abs(exact).max()), 1e-3)
        allowed = 1e-5 * scale + 30 * float(np.abs(rough - exact).max())
        for native in native_with_each_set(model, kernel):
            answers = native.run(given)
            assert np.abs(answers - exact).max() <= allowed, (seed, native.runtime)
            assert np.array_equal(answers, [native.run(row) for row in given]), (seed, native.runtime)


def test_foten_is_as_near_the_reference_as_single_precision_can_be(kernel):
    model = specimens.foten()
    assert specimens.count_parameters(model) == 471_235
    given = specimens.windows(100)
    exact = doubled(model).run(given)
    for native in native_with_each_set(model, kernel):
        assert np.abs(native.run(given) - exact).max() <= 1e-6 * specimens.SPREAD[0], native.runtime


def test_weights_that_were_stored_in_half_precision_are_run_so_and_exactly(kernel):
    model = specimens.foten(3)
    stored = Model(
        model.card, {name: tensor.astype(np.float16).astype(np.float32) for name, tensor in model.tensors.items()}
    )
    given = specimens.windows(20)
    for native in native_with_each_set(stored, kernel):
        assert np.abs(native.run(given) - doubled(stored).run(given)).max() <= 1e-6 * specimens.SPREAD[0]
    some = np.array([[1.5, -2.25], [2.0**-14, 65504.0]])
    assert halves(some) and not halves(some + 1e-4) and not halves(some * 2)
    instructions = InstructionSet(0, "x", 4)
    assert np.array_equal(packed(some, instructions, half=True).view(np.float16).reshape(2, 4)[:, :2], some)


def test_half_weights_of_a_single_row_whose_numbers_lie_apart(kernel):
    """One place of several, a row for each channel: its numbers are not side by side."""
    draw = chance(4)
    tensors = {"w": draw.integers(-3, 4, (5, 6, 1)).astype(np.float32), "b": np.zeros(5, np.float32)}
    steps = (Reshape(shape=(6, 4)), Activation(function="softmax"), Part(start=3, stop=4, along="length"))
    model = Model(card_of((*steps, Conv(weight="w", bias="b"), Reshape(shape=(5,))), 24, 5), tensors)
    given = draw.standard_normal((3, 24))
    for native in native_with_each_set(model, kernel):
        np.testing.assert_allclose(native.run(given), model.run(given), atol=1e-6)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_are_within_a_few_units_of_the_last_place(kernel, name):
    given = np.concatenate([np.linspace(-30, 30, 4000), np.geomspace(1e-6, 80, 500), -np.geomspace(1e-6, 80, 500)])
    given = given.astype(np.float32).astype(np.float64).reshape(-1, 500)
    model = Model(card_of((Activation(function=name),), 500, 500), {})
    expected = model.run(given)
    for native in native_with_each_set(model, kernel):
        far = np.abs(native.run(given) - expected)
        assert (far <= 3 * SINGLE * np.maximum(np.abs(expected), 0.5 if name != "exp" else 0)).all(), native.runtime


def test_an_autoregression_is_computed_in_double_precision(kernel):
    for order, points in ((20, 12), (7, 5), (40, 2), (1, 1)):
        model, given = predictor(order, points)
        expected = model.run(given)
        for native in native_with_each_set(model, kernel):
            np.testing.assert_allclose(native.run(given), expected, rtol=1e-10, atol=1e-10)


def test_an_autoregression_may_be_damped_before_but_nothing_else(kernel):
    """As trained ones and those of the toolkit are: every number of the input by a factor of its own."""
    model, given = predictor(9, 6)
    damping = np.stack([0.99 ** np.arange(40, 0, -1), np.full(40, 1.1), np.full(40, 0.7)])

    def after(step, **more):
        steps = (model.card.steps[0], step, *model.card.steps[1:])
        return Model(model.card.model_copy(update={"steps": steps}), {**model.tensors, "d": damping, **more})

    damped = after(Affine(gain="d"))
    for native in native_with_each_set(damped, kernel):
        np.testing.assert_allclose(native.run(given), damped.run(given), rtol=1e-10, atol=1e-10)
    none = np.where(np.arange(120) == 79, 0.0, 1.0).reshape(3, 40)
    for other in (after(Affine(offset=1.0)), after(Affine(gain="n"), n=none), after(Reshape(shape=(3, 40))), damped):
        runtime = fastest(other)
        assert runtime.runtime.startswith("native") or "a predictor of anything but the input" in runtime.why
        np.testing.assert_allclose(runtime.run(given), other.run(given), rtol=1e-10, atol=1e-10)


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
    exact = doubled(model).run(given)
    for native in native_with_each_set(model, kernel):
        np.testing.assert_allclose(native.run(given), exact, atol=1e-4 * np.abs(exact).max())


def test_several_threads_may_share_one_model(kernel):
    native = Native(specimens.foten(), kernel, kernel.sets[0], fastest)
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


def test_normalisation_is_done_in_double_precision(kernel):
    """A channel that hardly varies around a large value: in single precision its digits would be gone."""
    about, sd = 1e6, 1e-2
    steps = (Affine(gain=1 / sd, offset=-about / sd), Dense(weight="w", bias="b"))
    model = Model(card_of(steps, 4, 1), {"w": np.ones((1, 4)), "b": np.zeros(1)})
    given = about + sd * chance(2).standard_normal((10, 4))
    np.testing.assert_allclose(fastest(model).run(given), model.run(given), rtol=1e-5, atol=1e-6)
    assert fastest(model).runtime.startswith("native")

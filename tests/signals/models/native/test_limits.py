"""What the kernel does not answer, NumPy answers or refuses; nothing is answered that only looks like an answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.linalg._umath_linalg as math_library
import pytest

from benchmarks.synthesis import specimens
from palpate.signals.models.card import Activation, Affine, Dense, Kernel, Port, Reshape
from palpate.signals.models.card_steps import Attention, Norm, Part, Polar
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.fastest import ByNumpy, fastest
from palpate.signals.models.native import library as libraries
from palpate.signals.models.native.library import KernelMissing, Library, opened
from palpate.signals.models.native.opened import Native
from palpate.signals.models.native.values import NotCompiled
from palpate.signals.models.runtime import Model
from tests.signals.models.native.random_cards import card_of
from tests.signals.models.native.test_native import native_with_each_set, predictor


@pytest.mark.needs("compiler")
def test_a_hand_too_far_away_to_tell_the_nearest_triangle_is_refused(kernel):
    model, given = predictor(7, 5)
    for place in (79, 119):
        far = np.where(np.arange(120) == place, 1e308, given[0])
        for native in native_with_each_set(model, kernel):
            with pytest.raises(ModelInputError, match="no finite answer"):
                native.run(far)


@pytest.mark.needs("compiler")
def test_a_variance_beyond_single_precision_never_looks_like_an_answer(kernel):
    """1 / sqrt(inf) would hide it; NumPy answers where the numbers are held in double precision, or refuses."""
    tensors = {"w": np.eye(2, dtype=np.float32), "b": np.zeros(2, np.float32)}
    steps = (Dense(weight="w", bias="b"), Norm(weight="n", bias="s"), Affine(gain=2.0))
    given = np.array([1e25, -3e24])
    for kind in (np.float32, np.float64):
        model = Model(card_of(steps, 2, 2), {**tensors, "n": np.ones(2, kind), "s": np.ones(2, kind)})
        for native in native_with_each_set(model, kernel):
            if kind is np.float64:
                assert np.array_equal(native.run(given), model.run(given))
                continue
            with pytest.raises(ModelInputError, match="no finite answer"):
                native.run(given)


@pytest.mark.needs("compiler")
def test_scores_beyond_single_precision_choose_no_places(kernel):
    weight = np.ones((6, 2), np.float32) * np.arange(1, 7, dtype=np.float32)[:, None]
    tensors = {
        "w": weight,
        "b": np.zeros(6, np.float32),
        "o": np.eye(2, dtype=np.float32),
        "z": np.zeros(2, np.float32),
    }
    step = Attention(heads=1, weight="w", bias="b", out="o", out_bias="z", sparse=1)
    model = Model(card_of((Reshape(shape=(2, 3)), step, Reshape(shape=(6,))), 6, 6), tensors)
    for run in (model, *native_with_each_set(model, kernel)):
        assert run.run(np.ones(6)) == pytest.approx(model.run(np.ones(6)))
        with pytest.raises(ModelInputError, match="no finite answer"):
            run.run(np.array([1e20, 1.0, 1.0, 1e20, 1.0, 1.0]))


@pytest.mark.needs("compiler")
def test_numbers_that_no_model_answers_are_refused_in_numpys_words(kernel):
    model = specimens.foten()
    native = Native(model, kernel, kernel.sets[0], fastest)
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


@pytest.mark.needs("compiler")
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


@pytest.mark.needs("compiler")
def test_silence_spikes_and_numbers_near_zero_are_answered(kernel):
    model = specimens.foten()
    for native in native_with_each_set(model, kernel):
        for given in (np.zeros(60), np.full(60, 1e6), np.full(60, 1e-310), np.full(60, -1e-42)):
            assert native.run(given) == pytest.approx(model.run(given), rel=1e-3, abs=1e-3), native.runtime


@pytest.mark.needs("compiler")
def test_a_step_that_the_kernel_does_not_know_is_left_to_numpy(kernel):
    steps = (Kernel(points="p", weights="w", length=1.0),)
    model = Model(card_of(steps, 2, 1), {"p": np.ones((3, 2)), "w": np.ones((3, 1))})
    with pytest.raises(NotCompiled, match="the step kernel"):
        Native(model, kernel, kernel.sets[0], fastest)
    runtime = fastest(model)
    assert runtime == ByNumpy(model, "the step kernel")
    assert runtime.runtime == "NumPy" and runtime.run(np.ones(2)) == pytest.approx(model.run(np.ones(2)))


@pytest.mark.needs("compiler")
def test_a_model_that_is_too_large_for_a_kernel_is_left_to_numpy(kernel):
    """Before anything of that size is allocated."""
    one = {"w": np.ones((1, 3), np.float32), "b": np.zeros(1, np.float32)}
    dense = Dense(weight="w", bias="b")
    soft = (Activation(function="softmax"),)
    wide = {"w": np.ones((2**21, 3), np.float32), "b": np.zeros(2**21, np.float32)}
    for steps, tensors, inputs, outputs, why in (
        ((Part(start=0, stop=3), dense), one, 4_000_000, 1, "an input of 4000000 numbers"),
        ((Reshape(shape=(1, 3)), *soft * 2500, Reshape(shape=(3,))), {}, 3, 3, "2501 operations"),
        ((Part(start=0, stop=3), dense, Reshape(shape=(2, 2**20)), Polar(), Part(start=0, stop=1), Part(start=0, stop=1,
          along="length"), Reshape(shape=(1,))), wide, 1000, 1, "a spectrum of 2097152 numbers"),
        ((dense,), {**one, "w": np.full((1, 3), 1e39)}, 3, 1, "numbers beyond single precision"),
        ((Affine(gain=1e300), Affine(gain=1e300), dense), one, 3, 1, "numbers beyond double precision"),
    ):  # fmt: skip
        model = Model(card_of(steps, inputs, outputs), tensors)
        with pytest.raises(NotCompiled, match=why):
            Native(model, kernel, kernel.sets[0], fastest)
    assert fastest(Model(card_of((dense,), 3, 1), {**one, "w": np.full((1, 3), 1e39)})).run(np.ones(3)) == 3e39


@pytest.mark.needs("compiler")
def test_a_model_without_steps_gives_what_it_takes(kernel):
    native = fastest(Model(card_of((), 3, 3), {}))
    assert native.runtime.startswith("native") and native.run(np.arange(3.0)).tolist() == [0, 1, 2]


@pytest.mark.needs("compiler")
def test_arrays_of_every_kind_are_answered_as_by_numpy(kernel):
    model = Model(card_of((Dense(weight="w", bias="b"),), 3, 1), {"w": np.ones((1, 3)), "b": np.zeros(1)})
    native, apart = fastest(model), np.arange(12.0).reshape(2, 6)[:, ::2]
    kinds = [np.asfortranarray(apart), apart[::-1], apart.astype(">f8"), apart.astype("f2"), apart.astype("i2")]
    for given in (apart, *kinds, np.ma.array(apart), apart[:0], apart.tolist(), apart.astype(np.longdouble)):
        assert np.array_equal(native.run(given), model.run(given))
    for given in (
        np.ones(3, bool),
        np.array(["a", "b", "c"]),
        np.ones(3, complex),
        np.full(3, np.longdouble("1e4000")),
    ):
        with pytest.raises(ModelInputError):
            native.run(given)


@pytest.mark.needs("compiler")
def test_an_interrupted_batch_leaves_nothing_behind(kernel):
    """A Ctrl-C that comes as a batch ends: the next step reads its own input, not an array that is gone."""

    def interrupted(_program, _count):
        raise KeyboardInterrupt

    native = Native(specimens.foten(), replace(kernel, many=interrupted), kernel.sets[0], fastest)
    given = specimens.windows(3)
    before = native.run(given[0])
    with pytest.raises(KeyboardInterrupt):
        native.run(given[1:])
    assert np.array_equal(native.run(given[0]), before)


def test_without_a_kernel_numpy_runs_the_model_and_says_why(monkeypatch, tmp_path):
    def missing() -> Library:
        return opened(tmp_path / "_kernel.so")

    monkeypatch.setattr(libraries, "library", missing)
    model = specimens.foten()
    runtime = fastest(model)
    assert isinstance(runtime, ByNumpy) and "Install the package again" in runtime.why
    assert np.array_equal(runtime.run(specimens.windows(1)), model.run(specimens.windows(1)))


def test_a_file_that_is_no_kernel_is_refused(tmp_path):
    other = tmp_path / "other.so"
    other.write_bytes(b"no library")
    with pytest.raises(KernelMissing, match="cannot be loaded"):
        opened(other)
    with pytest.raises(KernelMissing, match="palpate_version"):
        opened(Path(math_library.__file__))


@pytest.mark.needs("compiler")
def test_an_instruction_set_that_is_not_there_is_not_used(kernel):
    runtime = fastest(specimens.foten(), "AVX-1024")
    assert isinstance(runtime, ByNumpy) and "AVX-1024" in runtime.why

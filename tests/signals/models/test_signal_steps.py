"""The steps that continue a signal answer what their definitions say; what does not fit is refused by its step."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from palpate.signals.models.card import Activation, Affine, Card, Conv, Dense, Mean, Reshape, Residual, Weights
from palpate.signals.models.card_steps import (
    Add,
    Attention,
    Cartesian,
    Join,
    Keep,
    Lstm,
    Norm,
    Part,
    Polar,
    Recall,
    Turn,
)
from palpate.signals.models.errors import ModelInputError
from palpate.signals.models.file import read_model
from palpate.signals.models.runtime import Model
from tests.signals.models.cards import port, saved

RANDOM = np.random.Generator(np.random.PCG64(11))
CHANNELS, LENGTH, MANY = 6, 5, 11
SIZE = CHANNELS * LENGTH
X = RANDOM.normal(size=(MANY, CHANNELS, LENGTH)) * 2
START = (Reshape(shape=(CHANNELS, LENGTH)),)
WEIGHT = RANDOM.normal(size=(3 * CHANNELS, CHANNELS))
ATTENTION = {
    "w": WEIGHT, "b": RANDOM.normal(size=3 * CHANNELS), "o": RANDOM.normal(size=(CHANNELS, CHANNELS)),
    "ob": RANDOM.normal(size=CHANNELS),
}  # fmt: skip
ATTEND = {"weight": "w", "bias": "b", "out": "o", "out_bias": "ob"}
CONV = {"cw": RANDOM.normal(size=(CHANNELS, CHANNELS, 1)), "cb": RANDOM.normal(size=CHANNELS)}
THROUGH = Conv(weight="cw", bias="cb")
"""The steps after it hold values the other way round."""


def model_of(steps, tensors, takes, gives):
    weights = Weights(file="x.safetensors", sha256="0" * 64, bytes=1)
    card = Card(name="x", title="", method="x", weights=weights, takes=takes, gives=gives, steps=tuple(steps))
    return Model(card, tensors)


def require(steps, tensors, expected, given=X, double=1e-12, single=1e-5):
    """One by one and in a batch, in double and in single precision; what was given is left alone."""
    expected = np.reshape(expected, (len(given), -1))
    flat = given.reshape(len(given), -1)
    before = flat.copy()
    ports = port(flat.shape[1]), port(expected.shape[1])
    steps = (*steps, Reshape(shape=(expected.shape[1],)))
    model = model_of(steps, tensors, *ports)
    top = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(model.run(flat), expected, rtol=0, atol=double * top)
    np.testing.assert_allclose([model.run(row) for row in flat], expected, rtol=0, atol=double * top)
    rough = model_of(steps, {name: value.astype(np.float32) for name, value in tensors.items()}, *ports)
    np.testing.assert_allclose(rough.run(flat), expected, rtol=0, atol=single * top)
    assert np.array_equal(before, flat)


def both_ways(steps, tensors, reference, **others):
    """From a value saved as (channels, length), and from one saved the other way round."""
    require((*START, *steps), tensors, reference(X), **others)
    through = np.einsum("oc,ncl->nol", CONV["cw"][:, :, 0], X) + CONV["cb"][:, None]
    require((*START, THROUGH, *steps), {**tensors, **CONV}, reference(through), **others)


def heads_of(x, heads):
    return x.reshape(heads, -1, x.shape[-1])


def attended(x, memory, heads, causal=False, sparse=None):
    """The definition, query by query."""
    width = len(x)
    queries, keys, values = (
        heads_of(ATTENTION["w"][part] @ source + ATTENTION["b"][part][:, None], heads)
        for part, source in (
            (slice(0, width), x), (slice(width, 2 * width), memory), (slice(2 * width, None), memory)
        )
    )  # fmt: skip
    answers = np.empty((heads, width // heads, x.shape[1]))
    for head in range(heads):
        scores = queries[head].T @ keys[head] / np.sqrt(width / heads)
        apart = scores.max(axis=1) - scores.mean(axis=1)
        asking = sorted(range(len(scores)), key=lambda place: (-apart[place], place))[: sparse or len(scores)]
        for place in range(x.shape[1]):
            seen = slice(0, place + 1) if causal else slice(None)
            if place in asking:
                shares = np.exp(scores[place, seen] - scores[place, seen].max())
                answers[head, :, place] = values[head][:, seen] @ shares / shares.sum()
            else:
                known = values[head][:, seen]
                answers[head, :, place] = known.sum(axis=1) if causal else known.mean(axis=1)
    return ATTENTION["o"] @ answers.reshape(width, -1) + ATTENTION["ob"][:, None]


@pytest.mark.parametrize("heads", [1, 3])
@pytest.mark.parametrize("causal", [False, True])
@pytest.mark.parametrize("sparse", [None, 2, 9])
def test_attention_is_its_definition(heads, causal, sparse):
    step = Attention(**ATTEND, heads=heads, causal=causal, sparse=sparse)
    both_ways((step,), ATTENTION, lambda xs: [attended(x, x, heads, causal, sparse) for x in xs])


@pytest.mark.parametrize("causal", [False, True])
def test_attention_to_saved_values(causal):
    memory = X[:, :, ::-1] ** 2 if causal else np.concatenate([X**2, X[:, :, :2] ** 2], axis=2)
    wide = np.concatenate([X, memory], axis=2)
    take = Reshape(shape=(CHANNELS, wide.shape[2]))
    first = Part(start=LENGTH, stop=wide.shape[2], along="length")
    steps = (
        take, Keep(kept="all"), first, Keep(kept="memory"), Recall(kept="all"),
        Part(start=0, stop=LENGTH, along="length"), Attention(**ATTEND, heads=2, memory="memory", causal=causal),
    )  # fmt: skip
    expected = [attended(x, m, 2, causal) for x, m in zip(X, memory, strict=True)]
    require(steps, ATTENTION, expected, given=wide)


@pytest.mark.needs("torch")
def test_attention_and_norm_are_those_of_torch():
    import torch

    torch.set_num_threads(1)
    theirs = torch.nn.MultiheadAttention(CHANNELS, 3, batch_first=True, dtype=torch.float64)
    norm = torch.nn.LayerNorm(CHANNELS, eps=1e-6, dtype=torch.float64)
    tensors = {"n": RANDOM.normal(size=CHANNELS), "nb": RANDOM.normal(size=CHANNELS), **ATTENTION}
    with torch.no_grad():
        for name, value in (
            (norm.weight, "n"), (norm.bias, "nb"), (theirs.in_proj_weight, "w"), (theirs.in_proj_bias, "b"),
            (theirs.out_proj.weight, "o"), (theirs.out_proj.bias, "ob"),
        ):  # fmt: skip
            name.copy_(torch.tensor(tensors[value]))

        def reference(x):
            y = norm(torch.tensor(x).swapaxes(1, 2))
            return theirs(y, y, y)[0].swapaxes(1, 2).numpy()

        both_ways((Norm(weight="n", bias="nb", tiny=1e-6), Attention(**ATTEND, heads=3)), tensors, reference)


def test_a_norm_of_a_list_is_over_all_its_numbers():
    weight, bias = RANDOM.normal(size=(2, SIZE))
    flat = X.reshape(MANY, -1)
    expected = (flat - flat.mean(1, keepdims=True)) / np.sqrt(flat.var(1, keepdims=True) + 1e-5) * weight + bias
    require((Norm(weight="w", bias="b"),), {"w": weight, "b": bias}, expected)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.needs("torch")
def test_a_memory_along_the_length_is_that_of_torch(reverse):
    import torch

    torch.set_num_threads(1)
    theirs = torch.nn.LSTM(CHANNELS, 4, batch_first=True, dtype=torch.float64)
    tensors = {
        "w": theirs.weight_ih_l0, "s": theirs.weight_hh_l0, "b": theirs.bias_ih_l0 + theirs.bias_hh_l0,
    }  # fmt: skip
    tensors = {name: value.detach().numpy() for name, value in tensors.items()}

    def reference(x):
        x = x[:, :, ::-1] if reverse else x
        with torch.no_grad():
            y = theirs(torch.tensor(x.swapaxes(1, 2).copy()))[0].numpy().swapaxes(1, 2)
        return y[:, :, ::-1] if reverse else y

    both_ways((Lstm(weight="w", state="s", bias="b", reverse=reverse),), tensors, reference)


def softmax(x):
    e = np.exp(x - x.max(-1, keepdims=True))
    return e / e.sum(-1, keepdims=True)


@pytest.mark.parametrize(
    ("function", "name", "options"),
    [
        ("relu", "relu", {}), ("tanh", "tanh", {}), ("sigmoid", "sigmoid", {}), ("gelu", "gelu", {}),
        ("elu", "elu", {}), ("leaky", "leaky_relu", {"negative_slope": 0.2}),
        ("softplus", "softplus", {"threshold": 1e9}),
        ("exp", None, {}), ("square", None, {}), ("abs", None, {}), ("softmax", "softmax", {"dim": -1}),
    ],
)  # fmt: skip
@pytest.mark.needs("torch")
def test_activations_are_those_of_torch(function, name, options):
    import torch

    call = getattr(torch.nn.functional, name) if name else getattr(torch, function)

    def reference(x):
        return call(torch.tensor(x), **options).numpy()

    both_ways((Activation(function=function),), {}, reference)
    require((Activation(function=function),), {}, reference(X.reshape(MANY, -1)))
    with np.errstate(over="ignore"):
        far = np.array([[-800.0, -30.0, 0.0, 30.0, 600.0]]) if function != "exp" else np.array([[-800.0, -1, 0.0, 30]])
        require((Activation(function=function),), {}, reference(far), given=far)


def test_a_logarithm_is_taken_of_1e_10_at_least():
    given = np.array([[1.0, np.e, 0.0, -3.0, 1e-20, 1e300]])
    expected = np.log(np.maximum(given, 1e-10))
    require((Activation(function="log"),), {}, expected, given=given)


def test_magnitude_and_phase_and_back():
    given = np.concatenate([RANDOM.normal(size=(MANY, 2, 7)), np.zeros((MANY, 2, 1))], axis=2)
    given[0, :, :4] = [[-1.0, -1.0, 0.0, 1e200], [0.0, -0.0, -2.0, 1e200]]
    z = given[:, 0] + 1j * given[:, 1]
    polar = np.stack([np.abs(z), np.angle(z)], axis=1)
    steps = (Reshape(shape=(2, 8)), Polar())
    require(steps, {}, polar, given=given)
    require((*steps, Turn(), Turn(), Cartesian()), {}, given, given=given)
    turned = (Reshape(shape=(8, 2)), Turn(), Polar(), Turn())
    require(turned, {}, polar.swapaxes(1, 2), given=given.swapaxes(1, 2).copy())


def test_values_are_saved_recalled_added_joined_split_and_transposed():
    relu = np.maximum(X, 0)
    steps = (
        *START, Keep(kept="x"), Affine(gain=2.0), Activation(function="relu"), Keep(kept="x2"), Add(kept="x"),
        Keep(kept="sum"), Activation(function="square"), Recall(kept="sum"), Join(kept=("x", "x2")),
        Part(start=4, stop=13), Part(start=1, stop=4, along="length"), Turn(),
    )  # fmt: skip
    together = np.concatenate([2 * relu + X, X, 2 * relu], axis=1)
    require(steps, {}, together[:, 4:13, 1:4].swapaxes(1, 2))
    through = np.einsum("oc,ncl->nol", CONV["cw"][:, :, 0], X) + CONV["cb"][:, None]
    mixed = (*START, Keep(kept="x"), THROUGH, Keep(kept="y"), Add(kept="x"), Join(kept=("x", "y")))
    require(mixed, CONV, np.concatenate([through + X, X, through], axis=1))
    lists = (Keep(kept="x"), Part(start=3, stop=5), Join(kept=("x",)))
    flat = X.reshape(MANY, -1)
    require(lists, {}, np.concatenate([flat[:, 3:5], flat], axis=1))


def test_a_value_may_be_saved_again_and_read_inside_other_steps():
    inner = Residual(steps=(Activation(function="square"), Keep(kept="x"), Affine(gain=-1.0), Add(kept="x")))
    mean = Mean(members=((Recall(kept="x"),), (Affine(gain=3.0),)))
    steps = (Keep(kept="x"), Affine(gain=0.5), inner, mean)
    flat = X.reshape(MANY, -1)
    expected = ((flat / 2) ** 2 + 3 * np.maximum(flat / 2, 0)) / 2
    require(steps, {}, expected, single=1e-5)


def test_what_overflows_within_is_refused_and_never_looks_like_an_answer():
    one = {"n": np.ones(SIZE, dtype=np.float32), "nb": np.zeros(SIZE, dtype=np.float32)}
    model = model_of((Norm(weight="n", bias="nb"),), one, port(SIZE), port(SIZE))
    given = np.zeros(SIZE)
    assert np.isfinite(model.run(given)).all()
    given[3] = 1e25
    with pytest.raises(ModelInputError, match="no finite answer"):
        model.run(given)
    attention = {name: value.astype(np.float32) for name, value in ATTENTION.items()}
    model = model_of(
        (*START, Attention(**ATTEND, heads=1), Reshape(shape=(SIZE,))), attention, port(SIZE), port(SIZE)
    )  # fmt: skip
    assert np.isfinite(model.run(given / 1e19)).all()
    with pytest.raises(ModelInputError, match="no finite answer"):
        model.run(given)


def test_threads_share_a_model_and_no_run_sees_another(tmp_path):
    steps = (
        *START, Keep(kept="x"), Lstm(weight="w", state="s", bias="b"), Keep(kept="y"), Attention(**{
            "weight": "aw", "bias": "ab", "out": "ao", "out_bias": "aob"}, heads=2), Add(kept="y"), Add(kept="x"),
        Reshape(shape=(SIZE,)),
    )  # fmt: skip
    tensors = {
        "w": RANDOM.normal(size=(4 * CHANNELS, CHANNELS)), "s": RANDOM.normal(size=(4 * CHANNELS, CHANNELS)),
        "b": RANDOM.normal(size=4 * CHANNELS), **{f"a{name}": value for name, value in ATTENTION.items()},
    }  # fmt: skip
    model = read_model(saved(tmp_path, steps, tensors, port(SIZE), port(SIZE)))
    rows = X.reshape(MANY, -1)
    alone = [model.run(row) for row in rows]
    with ThreadPoolExecutor(4) as pool:
        assert np.array_equal(list(pool.map(model.run, np.tile(rows, (20, 1)))), alone * 20)


def test_numbers_stored_in_half_precision_are_read_as_single(tmp_path):
    weight = RANDOM.normal(size=(2, 3)).astype(np.float16)
    bias = np.array([1.0, 2.0], dtype=np.float16)
    model = read_model(saved(tmp_path, (Dense(weight="w", bias="b"),), {"w": weight, "b": bias}, port(3), port(2)))
    assert {tensor.dtype.name for tensor in model.tensors.values()} == {"float32"}
    given = np.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(model.run(given), weight.astype(float) @ given + bias, rtol=1e-6)

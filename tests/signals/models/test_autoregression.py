"""A predictor that follows speed and force is what its definition says, wherever the hand is, and always stable."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.signals.models.card import Reshape
from palpate.signals.models.card_steps import Autoregression
from palpate.signals.models.errors import ModelFileError, ModelInputError
from palpate.signals.models.sequence_layers import predictor_of
from tests.signals.models.cards import port
from tests.signals.models.test_signal_steps import model_of

RANDOM = np.random.Generator(np.random.PCG64(5))
POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0], [0.4, 0.9]])
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
ORDER, LENGTH = 6, 9


def rising(count, order, gap=0.05):
    steps = RANDOM.uniform(gap, 1, size=(count, order + 1))
    return np.cumsum(steps, axis=1)[:, :-1] / steps.sum(axis=1, keepdims=True) * np.pi


TENSORS = {"p": POINTS, "f": rising(5, ORDER), "s": RANDOM.normal(size=5), "t": TRIANGLES}
STEP = Autoregression(points="p", frequencies="f", log_sd="s", triangles="t")


def model(tensors=TENSORS, length=LENGTH):
    return model_of((Reshape(shape=(3, length)), STEP), tensors, port(3 * length), port(2))


def window(speed, force, length=LENGTH):
    past = RANDOM.normal(size=length)
    return np.concatenate([past, RANDOM.normal(size=length - 1), [speed], RANDOM.normal(size=length - 1), [force]])


def error_filter(frequencies):
    """The mean of the symmetric and the antisymmetric polynomial, multiplied out factor by factor."""
    even = len(frequencies) % 2 == 0
    halves = [np.array([1.0, 1.0] if even else [1.0]), np.array([1.0, -1.0] if even else [1.0, 0.0, -1.0])]
    for place, frequency in enumerate(frequencies):
        halves[place % 2] = np.convolve(halves[place % 2], [1, -2 * np.cos(frequency), 1])
    return (halves[0] + halves[1])[: len(frequencies) + 1] / 2


def expected(given, shares):
    frequencies, log_sd = shares @ TENSORS["f"], shares @ TENSORS["s"]
    coefficients = error_filter(frequencies)
    past = given[:LENGTH][::-1]
    return [-sum(coefficients[k] * past[k - 1] for k in range(1, ORDER + 1)), log_sd]


INSIDE = [
    (40.0, 0.9, [0, 0, 0, 0, 1]), (0.0, 0.0, [1, 0, 0, 0, 0]), (50.0, 0.0, [0.5, 0.5, 0, 0, 0]),
    (100.0, 1.0, [0, 0.5, 0.5, 0, 0]),
]  # fmt: skip
OUTSIDE = [
    (50.0, -3.0, [0.5, 0.5, 0, 0, 0]), (900.0, 9.0, [0, 0, 1, 0, 0]), (1e6, -1e6, [0, 1, 0, 0, 0]),
    (-20.0, 1.0, [0.5, 0, 0, 0.5, 0]),
]  # fmt: skip


@pytest.mark.parametrize(("speed", "force", "shares"), [*INSIDE, *OUTSIDE])
def test_it_is_interpolated_within_and_the_nearest_rim_outside(speed, force, shares):
    given = window(speed, force)
    np.testing.assert_allclose(model().run(given), expected(given, np.array(shares)), rtol=0, atol=1e-12)


def test_anywhere_within_the_shares_are_those_of_the_triangle():
    from scipy import spatial as scipy

    triangulation = scipy.Delaunay(POINTS)
    assert {tuple(sorted(triangle)) for triangle in triangulation.simplices} == {
        tuple(sorted(triangle)) for triangle in TRIANGLES.tolist()
    }
    rows, expected_rows = [], []
    for place in RANDOM.uniform([0, 0], [1, 2], size=(50, 2)):
        around = set(triangulation.simplices[triangulation.find_simplex(place)])
        corners = TRIANGLES[np.flatnonzero([set(triangle) == around for triangle in TRIANGLES])[0]]
        shares = np.zeros(5)
        shares[corners] = np.linalg.solve(np.vstack([POINTS[corners].T, np.ones(3)]), [*place, 1])
        rows.append(window(place[0] * 100, place[1]))
        expected_rows.append(expected(rows[-1], shares))
    np.testing.assert_allclose(model().run(np.array(rows)), expected_rows, rtol=0, atol=1e-12)
    np.testing.assert_allclose([model().run(row) for row in rows], expected_rows, rtol=0, atol=1e-12)
    rough = model(
        {name: tensor.astype(np.float32) if tensor.dtype == float else tensor for name, tensor in TENSORS.items()}
    )
    np.testing.assert_allclose(rough.run(np.array(rows)), expected_rows, rtol=0, atol=1e-5)


@pytest.mark.parametrize("order", [1, 2, 3, 10, 19, 30])
def test_frequencies_become_the_filter_that_they_are_of(order):
    frequencies = rising(4, order)
    filters = predictor_of(order)(frequencies)
    expected_filters = np.array([error_filter(row) for row in frequencies])
    np.testing.assert_allclose(
        filters, -expected_filters[:, 1:], rtol=0, atol=1e-12 * np.abs(expected_filters).max() * 2**order**0.5
    )


@pytest.mark.parametrize("precision", [np.float64, np.float32, np.float16])
@pytest.mark.parametrize("order", [1, 2, 7, 20])
def test_every_mixture_of_rising_frequencies_is_stable(order, precision):
    corners = rising(3, order, gap=0.3).astype(precision).astype(float)
    steps = np.linspace(0, 1, 25)
    grid = np.array([[a, b, 1 - a - b] for a in steps for b in steps if a + b <= 1 + 1e-12])
    shares = np.concatenate([grid, RANDOM.dirichlet([0.3] * 3, size=200)])
    filters = predictor_of(order)(shares @ corners)
    assert max(np.abs(np.roots([1.0, *-row])).max() for row in filters) < 1


@pytest.mark.parametrize(
    ("points", "triangles", "place", "shares"),
    [
        ([[0.5, 1.0]], [[0, 0, 0]], (3.0, 7.0), [1.0]),
        ([[0.0, 1.0], [2.0, 1.0]], [[0, 1, 1]], (0.5, 9.0), [0.75, 0.25]),
        ([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]], [[0, 1, 1], [1, 2, 2]], (2.0, 2.0), [0.0, 0.5, 0.5]),
        ([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]], [[0, 1, 2]], (-4.0, 0.0), [1.0, 0.0, 0.0]),
        ([[0.0, 0.0], [0.0, 0.0]], [[0, 1, 1]], (0.0, 0.0), [1.0, 0.0]),
    ],
)
def test_points_on_a_line_or_a_single_one(points, triangles, place, shares):
    count = len(points)
    some = {"p": np.array(points), "f": TENSORS["f"][:count], "s": TENSORS["s"][:count], "t": np.array(triangles)}
    given = window(100 * place[0], place[1])
    mixed = expected(given, np.array([*shares, *[0.0] * (5 - count)]))
    np.testing.assert_allclose(model(some).run(given), mixed, rtol=0, atol=1e-12)


def test_it_never_answers_what_is_not_finite():
    given = window(50.0, 1.0)
    for value in (np.nan, np.inf):
        with pytest.raises(ModelInputError, match="at place 27"):
            model().run(np.concatenate([given[:-1], [value]]))
    assert np.isfinite(model().run(np.where(np.arange(27) == 8, 1e6, given))).all()
    with pytest.raises(ModelInputError, match="no finite answer"):
        model().run(np.where(np.arange(27) == 17, 1e308, given))


def changed(**others):
    return {**TENSORS, **{name: np.array(value) for name, value in others.items()}}


F = TENSORS["f"]


@pytest.mark.parametrize(
    ("tensors", "words"),
    [
        (changed(f=F[:, ::-1]), "'f' does not rise from above 0 to below pi at every point: not stable"),
        (changed(f=F - F[0, 0]), "does not rise"),
        (changed(f=F + np.pi - F[0, -1]), "does not rise"),
        (changed(f=np.repeat(F[:, :3], 2, axis=1)), "does not rise"),
        (changed(f=rising(5, 10)), "'f' looks 10 samples back at 5 points; 9 samples come"),
        (changed(f=F[:4]), r"'f' has shape \(4, 6\); \(5, any\) is expected"),
        (changed(s=TENSORS["s"][:3]), r"'s' has shape \(3,\); \(5\) is expected"),
        (changed(t=[[0, 1, 5]]), "'t' names a point that is not there; there are 5"),
        (changed(t=[[0, 1, -1]]), "names a point that is not there"),
        (changed(t=[[0.0, 1.0, 2.0]]), "'t' is float64; int32 or int64"),
        (changed(p=POINTS[:, :1]), r"'p' has shape \(5, 1\); \(any, 2\)"),
    ],
)
def test_what_is_no_stable_predictor_is_refused(tensors, words):
    with pytest.raises(ModelFileError, match=rf"step 2 \(autoregression\): .*{words}"):
        model(tensors)


def test_it_takes_three_channels():
    with pytest.raises(ModelFileError, match=r"shape \(27,\) comes to it; \(3, length\) is expected"):
        model_of((STEP,), TENSORS, port(27), port(2))

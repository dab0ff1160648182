"""Maps compared and adjectives fitted: vegan's numbers, and what must not matter."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.spaces.procrustes import procrustes
from palpate.analysis.spaces.vectors import property_vectors
from palpate.analysis.statistics.refusals import BadValue, IncompleteCells, TooFew
from tests.analysis.spaces.spaces_for_tests import attitude, in_r


def both() -> tuple[pd.DataFrame, pd.DataFrame]:
    result = in_r()["procrustes"]
    return pd.DataFrame(result["x"]), pd.DataFrame(result["y"])


@pytest.mark.parametrize("scale", [True, False])
def test_the_fit_is_that_of_vegan(scale: bool) -> None:
    result, expected = procrustes(*both(), scale=scale), in_r()["procrustes"]["scaled" if scale else "unscaled"]
    assert result.squares == pytest.approx(expected["ss"], rel=1e-12)
    assert result.turn == pytest.approx(np.array(expected["rotation"]), abs=1e-13)
    assert result.stretch == pytest.approx(expected["scale"], rel=1e-13)
    assert result.shift == pytest.approx(expected["translation"], abs=1e-9)
    assert result.fitted.to_numpy() == pytest.approx(np.array(expected["fitted"]), abs=1e-9)
    assert [result.r, result.m2] == pytest.approx([in_r()["procrustes"]["r"], in_r()["procrustes"]["m2"]], rel=1e-12)


def test_the_permutation_test_is_that_of_vegan() -> None:
    target, expected = both()[0], in_r()["procrustes"]["weak"]
    result = procrustes(target, pd.DataFrame(expected["y"]), draws=9999)
    assert result.r == pytest.approx(expected["r"], rel=1e-12)
    assert result.p == pytest.approx(expected["p"], abs=4 * np.sqrt(expected["p"] / 9999))


def test_few_objects_are_permuted_in_every_way() -> None:
    target, other = (frame.iloc[:5] for frame in both())
    result = procrustes(target, other, draws=200)
    assert result.exact
    assert result.draws == 120
    assert result.p * 120 == pytest.approx(round(result.p * 120))
    assert result.p > 0


def test_a_mirror_image_needs_reflection() -> None:
    target = pd.DataFrame(np.random.default_rng(2).normal(size=(12, 2)))
    mirror = target * [1, -1]
    assert procrustes(target, mirror).m2 == pytest.approx(0, abs=1e-12)
    assert procrustes(target, mirror).reflection
    turned = procrustes(target, mirror, reflection=False)
    assert not turned.reflection
    assert turned.m2 > 0.1
    assert np.linalg.det(turned.turn) == pytest.approx(1)


def test_order_of_objects_and_direction_do_not_matter() -> None:
    target, other = both()
    one = procrustes(target, other, draws=99)
    two = procrustes(target, other.sample(frac=1, random_state=3), draws=99)
    assert one.fitted.equals(two.fitted)
    assert one.p == two.p
    assert procrustes(other, target).r == pytest.approx(one.r, rel=1e-13)
    assert procrustes(target, other * 1e9 + 1e6).r == pytest.approx(one.r, rel=1e-9)


def test_what_cannot_be_compared_is_refused() -> None:
    target, other = both()
    with pytest.raises(IncompleteCells, match="holds 3"):
        procrustes(target, other.drop(index=3))
    with pytest.raises(BadValue, match="second configuration"):
        procrustes(target, other * 0)
    with pytest.raises(TooFew):
        procrustes(target.iloc[:2], other.iloc[:2])
    assert procrustes(target, other[[0]]).m2 > procrustes(target, other).m2


def test_vectors_are_those_of_envfit() -> None:
    expected = in_r()["envfit"]
    points = pd.DataFrame(expected["points"], columns=["Dim1", "Dim2"])
    result = property_vectors(points, attitude(), draws=4999).set_index("property").loc[in_r()["attitude_columns"]]
    assert result[["Dim1", "Dim2"]].to_numpy() == pytest.approx(np.array(expected["arrows"]), abs=1e-12)
    assert result["r2"].tolist() == pytest.approx(expected["r2"], rel=1e-12)
    assert result["p"].tolist() == pytest.approx(expected["p"], abs=0.002)


def test_a_vector_points_where_its_property_grows() -> None:
    points = pd.DataFrame(np.random.default_rng(2).normal(size=(12, 2)), columns=["Dim1", "Dim2"])
    properties = pd.DataFrame({"up": points["Dim2"] * 5 + 1e9, "still": 3.0})
    result = property_vectors(points, properties, draws=99).set_index("property")
    assert result.loc["up", ["Dim1", "Dim2"]].tolist() == pytest.approx([0, 1], abs=1e-6)
    assert result.loc["up", "p"] == 1 / 100
    assert np.isnan(result.loc["still", ["Dim1", "Dim2", "r2", "p", "p_F"]].astype(float)).all()
    assert "no direction" in result.loc["still", "note"]
    exact = property_vectors(points, properties - [1e9, 0]).set_index("property")
    assert np.isnan(exact.loc["up", "F"])
    assert "without remainder" in exact.loc["up", "note"]


def test_a_map_that_fits_anything_is_refused() -> None:
    points = pd.DataFrame(np.random.default_rng(2).normal(size=(3, 2)))
    with pytest.raises(TooFew, match="fit any property"):
        property_vectors(points, pd.DataFrame({"a": [1, 2, 4]}))
    line = pd.DataFrame({"x": [1, 2, 3, 4.0], "y": [2, 4, 6, 8.0]})
    with pytest.raises(TooFew, match="multiples"):
        property_vectors(line, pd.DataFrame({"a": [1, 2, 4, 3]}))

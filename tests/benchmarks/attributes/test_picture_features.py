"""The bench of pictures: both ways of co-occurrence are that of pairs that are counted."""

import numpy as np
import pytest

from benchmarks.attributes.picture_features import cases, count_pairs
from palpate.analysis.features.pictures import SIDE


@pytest.mark.needs("skimage")
def test_both_ways_give_what_counting_gives():
    errors = {case.method: case.error(case.run()) for case in cases(quick=True)}
    assert list(errors) == ["palpate", "scikit-image", "pairs counted by NumPy"]
    assert errors["palpate"] < 1e-6
    assert errors["scikit-image"] < 1e-12


def test_counting_by_hand():
    matrix = count_pairs(np.array([[0.0, 1.0], [0.0, 0.0]], np.float32)).reshape(16, 16)
    assert matrix.sum() == pytest.approx(1)
    assert matrix[0, 15] == matrix[15, 0] == pytest.approx((1 / 4 + 1 / 4 + 0 + 1 / 2) / 4)
    assert matrix[15, 15] == 0


def test_the_whole_bench_looks_at_a_picture_as_a_study_does():
    assert {case.n for case in cases(quick=False)} == {SIDE**2}

"""Points that stand side by side, and densities."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from palpate.analysis.figures.distributions import density, quartiles, summary, swarm, whiskers
from tests.examples import examples

VALUES = st.lists(st.integers(0, 40).map(lambda i: i / 4), min_size=1, max_size=40)


@given(VALUES, st.booleans())
@settings(max_examples=examples(80), deadline=None)
def test_no_two_points_of_a_swarm_touch(values: list[float], one_sided: bool) -> None:
    aside = swarm(values, 1.0, 1e9, one_sided=one_sided)
    for i in range(len(values)):
        for j in range(i):
            assert math.hypot(values[i] - values[j], aside[i] - aside[j]) >= 1 - 1e-6
    assert not one_sided or min(aside) >= 0


def test_a_swarm_stays_within_its_reach_and_is_the_same_each_time() -> None:
    values = [1.0] * 30
    assert max(map(abs, swarm(values, 1.0, 3.0))) == pytest.approx(3.0)
    many = np.random.Generator(np.random.PCG64(3)).normal(size=2000).tolist()
    assert swarm(many, 0.1, 0.4) == swarm(many, 0.1, 0.4)
    assert max(map(abs, swarm(many, 0.1, 0.4))) <= 0.4


def test_density_is_scipys_where_nothing_is_mirrored() -> None:
    values = np.random.Generator(np.random.PCG64(5)).normal(50, 9, 40)
    at, heights = density(values.tolist())
    silverman = 0.9 * min(np.std(values, ddof=1), stats.iqr(values) / 1.34) * 40**-0.2
    theirs = stats.gaussian_kde(values, silverman / np.std(values, ddof=1))(at)
    assert heights == pytest.approx(theirs / theirs.max(), rel=1e-10)


def test_mirrored_mass_keeps_the_density_up_at_its_end() -> None:
    values = np.linspace(0, 1, 200).tolist()
    _, open_end = density(values)
    _, mirrored = density(values, 0.0, 1.0)
    assert open_end[0] < 0.6
    assert mirrored.min() > 0.97


@pytest.mark.parametrize("values", [[1.0], [2.0, 2.0, 2.0], [1.0, 2.0, 1.0]])
def test_few_different_values_have_no_density(values: list[float]) -> None:
    assert len(density(values)[0]) == 0


def test_a_huge_offset_costs_no_digit() -> None:
    small, far = summary([1.0, 2.0, 4.0]), summary([2**40 + 1.0, 2**40 + 2.0, 2**40 + 4.0])
    assert far["sd"] == small["sd"]
    assert far["median"] - 2**40 == small["median"]
    assert quartiles([1.0, 2.0, 3.0, 4.0]) == (1.75, 2.5, 3.25)  # R 4.2.2 quantile(type = 7)
    assert whiskers([1.0, 2.0, 3.0, 4.0, 100.0]) == (1.0, 4.0)  # R 4.2.2 boxplot.stats

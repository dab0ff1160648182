"""The exact power and the exact coverage that simulated power is held against."""

import numpy as np
import pytest
from scipy.stats import t

from benchmarks import power as bench
from palpate.analysis.power.curve import wilson


def test_the_exact_power_is_that_of_students_t():
    """Two stimuli: F is the square of a paired t, whose noncentrality is sqrt(n) d / sqrt(2)."""
    from scipy.stats import nct

    critical = t.isf(0.025, 11)
    shift = np.sqrt(12) / np.sqrt(2)
    two_sided = nct.sf(critical, 11, shift) + nct.cdf(-critical, 11, shift)
    assert bench.exact_power(1.0) == pytest.approx(two_sided, abs=1e-9)
    assert bench.exact_power(0.0) == 0.05


@pytest.mark.long
def test_simulated_studies_have_the_exact_power():
    cases = bench.cases(True)  # which keeps the study's folder until it ends
    case = next(case for case in cases if case.input.startswith("effect 1"))
    assert case.error(case.run()) < 4 * np.sqrt(0.25 / 50)


def test_coverage_is_summed_over_the_binomial_distribution():
    whole = [(0.0, 1.0)] * 11
    assert bench.coverage_error(0.3, whole) == pytest.approx(0.05)
    only_five = [(0.0, 1.0) if count == 5 else (2.0, 3.0) for count in range(11)]
    assert bench.coverage_error(0.5, only_five) == pytest.approx(0.95 - 252 / 1024)


def test_wilson_is_nearer_than_wald_at_the_ends_and_never_as_wide_as_exact():
    errors = {
        name: bench.coverage_error(0.95, bench.all_intervals(interval, 50))
        for name, interval in (("wilson", wilson), ("wald", bench.wald))
    }
    assert errors["wilson"] < 0.02 < errors["wald"]
    low, high = bench.clopper_pearson(40, 50)
    assert low < wilson(40, 50)[0] and high > wilson(40, 50)[1]

"""What is called the maximum is one: no other point that is tried has a smaller deviance, on many made designs."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from palpate.analysis.mixed_models import optimising
from palpate.analysis.mixed_models.model import mixed_model
from palpate.analysis.mixed_models.problem import deviance, solve
from palpate.analysis.statistics.refusals import NotConverged
from tests.analysis.mixed_models.reference_for_tests import model_options, table


def random_design(seed):
    """A design whose size, variances (some zero, some huge) and gaps are drawn by lot."""
    rng = np.random.default_rng(seed)
    n, k = rng.integers(5, 15, 2)
    p, s, _ = np.indices((n, k, 2)).reshape(3, -1)
    x = rng.normal(size=k)[s] + 0.3 * rng.normal(size=len(p))
    one, two, three = rng.choice([0.0, 0.1, 1.0, 30.0, 1e4], 3)
    y = one * rng.normal(size=n)[p] + two * rng.normal(size=k)[s] + three * rng.normal(size=n)[p] * x
    whole = pd.DataFrame({"p": p, "s": s, "x": x, "y": y + rng.normal(size=len(p))})
    return whole[rng.random(len(whole)) < 0.85]


@pytest.mark.long
@pytest.mark.parametrize("seed", range(8))
def test_no_point_that_is_tried_is_better(seed):
    model = mixed_model(random_design(seed), "y", [], {"p": ["x"], "s": []}, numeric=["x"])
    fit, rng = model.fit, np.random.default_rng(seed)
    parameters, free = fit.best.parameters, fit.best.free
    assert model.distance < 1e-9
    for size in (1e-4, 1e-2, 0.3, 1.0, 3.0):
        for _ in range(12):
            factors = parameters.factors(free + size * rng.normal(size=len(free)))
            assert deviance(fit.problem, solve(fit.problem, fit.parts, factors), True) > fit.best.deviance - 1e-9


def test_a_search_that_is_cut_short_is_refused_and_not_called_converged(monkeypatch):
    monkeypatch.setattr(optimising, "_polished", lambda counted, parameters, factors: [f * 1.1 for f in factors])
    with pytest.raises(NotConverged, match="maximum was not reached"):
        mixed_model(table("sloped"), "y", **model_options("sloped"))

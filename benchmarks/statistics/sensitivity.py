"""Figures of sensitivity and of mixed models of choices: each implementation's error beside its time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.statistics.measuring import Way, comparison, relative_error
from palpate.analysis.choices.binomial_mixed import Counts, fit_binomial_mixed
from palpate.analysis.choices.detection import dprime_of_share, share_correct, share_odd
from palpate.analysis.statistics.doubles import Floats
from palpate.protocols.bench import Case

OURS = "palpate"
CBPP = """1 2/14 3/12 4/9 0/5
2 3/22 1/18 1/21 -
3 8/22 2/16 0/16 2/20
4 2/10 0/10 2/9 0/6
5 5/18 0/25 0/24 1/4
6 3/17 0/17 0/18 1/20
7 8/16 1/10 3/9 0/5
8 12/34 - - -
9 2/9 0/6 0/8 0/6
10 1/22 1/22 0/18 2/22
11 0/25 5/27 3/22 1/22
12 2/10 1/8 0/6 0/5
13 1/21 2/24 0/19 0/23
14 11/19 0/2 0/3 0/2
15 1/19 1/15 1/15 0/15"""
"""Contagious bovine pleuropneumonia (Lesnoff et al. 2004), cbpp in R's lme4: incidence/size in periods 1 to 4."""
GLMER = (-1.3983, -0.9919, -1.1282, -1.5797)
"""`glmer(cbind(incidence, size - incidence) ~ period + (1 | herd), cbpp, binomial)`, as lme4's help prints it."""


def cbpp() -> Counts:
    """Return the data set as counts: a random intercept for each herd, an effect of each period after the first."""
    rows = [
        (int(line.split()[0]) - 1, period, *map(float, cell.split("/")))
        for line in CBPP.splitlines()
        for period, cell in enumerate(line.split()[1:])
        if cell != "-"
    ]
    herd, period, hits, trials = (np.array(column) for column in zip(*rows, strict=True))
    fixed = np.column_stack([np.ones(len(herd)), *((period == k).astype(float) for k in (1, 2, 3))])
    return Counts(hits, trials, herd.astype(np.int64), fixed, np.ones((len(herd), 1)))


def cases(quick: bool) -> Iterator[Case]:
    """Yield the cases of d' and of a binomial mixed model; `quick` takes fewer values of d'."""
    right = np.linspace(0.2, 4, 5 if quick else 40)
    yield from _dprime("d', forced choice of 4", np.array([share_correct(d, 4) for d in right]), right, 4)
    yield from _dprime("d', triangle", np.array([share_odd(d) for d in right]), right, 3)

    def variational(counts: Counts) -> Floats:
        """Return fixed effects by variational Bayes; it takes single answers, not counts."""
        from statsmodels.genmod.bayes_mixed_glm import BinomialBayesMixedGLM

        repeats = counts.trials.astype(int)
        answers = np.concatenate(
            [np.repeat([1.0, 0.0], [int(k), int(n - k)]) for k, n in zip(counts.hits, counts.trials, strict=True)]
        )
        herds = np.eye(int(counts.group.max()) + 1)[np.repeat(counts.group, repeats)]
        model = BinomialBayesMixedGLM(
            answers, np.repeat(counts.fixed, repeats, axis=0), herds, np.zeros(herds.shape[1], dtype=int)
        )
        return np.asarray(model.fit_vb().fe_mean)

    ways: list[Way] = [
        (OURS, "numpy", lambda counts: fit_binomial_mixed(counts, "logit", 1).fixed),
        ("statsmodels BinomialBayesMixedGLM", "statsmodels", variational),
    ]
    counts = cbpp()
    kind = "relative, worst fixed effect; against R's glmer (four digits)"
    error = relative_error(np.array(GLMER))
    yield from comparison("binomial mixed model", "cbpp, 15 herds", len(counts.hits), ways, counts, error, kind)


def _dprime(title: str, shares: Floats, right: Floats, alternatives: int) -> Iterator[Case]:
    """Yield the cases of d' of shares of correct answers."""

    def ours(shares: Floats) -> Floats:
        design: Any = "oddity" if alternatives == 3 else "forced_choice"
        return np.array([dprime_of_share(float(share), design, alternatives) for share in shares])

    def adaptive(shares: Floats) -> Floats:
        """Return d' by adaptive quadrature within a search for a root, written plainly."""
        from scipy.integrate import quad
        from scipy.optimize import brentq
        from scipy.special import ndtr

        def density(x: float) -> float:
            return math.exp(-0.5 * x * x) / math.sqrt(2 * math.pi)

        def expected(d: float) -> float:
            if alternatives == 3:
                lift, steep = d * np.sqrt(2 / 3), np.sqrt(3)
                both = quad(lambda x: (ndtr(lift - x * steep) + ndtr(-lift - x * steep)) * density(x), 0, np.inf)
                return float(2 * both[0])
            part = quad(lambda x: density(x - d) * ndtr(x) ** (alternatives - 1), -np.inf, np.inf)
            return float(part[0])

        return np.array([brentq(lambda d, share=share: expected(d) - share, 0, 12) for share in shares])

    ways: list[Way] = [(OURS, "numpy", ours), ("scipy quad and brentq", "scipy", adaptive)]
    yield from comparison(
        title, f"{len(right)} values", len(right), ways, shares, relative_error(right), "relative, worst d'"
    )

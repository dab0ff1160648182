"""Figures of the spaces: each implementation's error beside its time, on R's answers and on shifted tables."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from scipy.spatial import procrustes as scipy_procrustes

from benchmarks.statistics.measuring import quietly, relative_error
from palpate.analysis.spaces.classical import classical_mds
from palpate.analysis.spaces.components import pca
from palpate.analysis.spaces.dissimilarities import Dissimilarities, dissimilarities_of
from palpate.analysis.spaces.nonmetric import nonmetric_mds
from palpate.analysis.spaces.procrustes import procrustes
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.references import reference_table
from palpate.protocols.bench import Case

AREA, OURS = "statistics", "palpate"
TRUTH = Path(__file__).with_name("spaces_truth.json")
Way: TypeAlias = tuple[str, str, Callable[[Any], Any]]  # name, package, what gives the numbers to compare


def cases(quick: bool) -> Iterator[Case]:
    """Yield components, maps and their comparison; without `quick` also non-metric maps from more starts."""
    truth = json.loads(TRUTH.read_text())
    yield from _components(truth)
    for name in ("eurodist", "ekman"):
        found = truth["sets"][name]
        frame = pd.DataFrame(found["values"], index=found["labels"], columns=found["labels"])
        between = dissimilarities_of(frame)
        yield from _maps(name, between, truth["eigenvalues"][name], truth["stress"][name], 4 if quick else 20)
    yield from _comparisons(truth["procrustes"])


def sklearn(module: str) -> Any:
    """Return a module of scikit-learn, which is optional."""
    return import_module(f"sklearn.{module}")


def _components(truth: Any) -> Iterator[Case]:
    table = reference_table("csv/attitude_wide.csv")
    table = table[[name for name in table.columns if name not in ("subject", "Unnamed: 0")]].astype(float)
    for kind in ("covariance", "correlation"):
        right = np.array(truth["sdev"][kind])
        ways = _component_ways(kind)
        title, error = "principal components against R", relative_error(right)
        yield from _cases(title, f"attitude, {kind}", ways, table, error, "relative, worst SD; against R")
        far = table + 1e9
        title = "principal components, offset 1e9"
        yield from _cases(title, f"attitude, {kind}", ways, far, error, "relative, worst SD; exact answer")


def _component_ways(kind: Any) -> list[Way]:
    def ours(table: pd.DataFrame) -> Floats:
        return np.sqrt(pca(table, kind).variances)

    def scikit(table: pd.DataFrame) -> Floats:
        values = table.to_numpy()
        values = (values - values.mean(axis=0)) / values.std(axis=0, ddof=1) if kind == "correlation" else values
        return np.asarray(np.sqrt(sklearn("decomposition").PCA().fit(values).explained_variance_))

    def statsmodels(table: pd.DataFrame) -> Floats:
        from statsmodels.multivariate.pca import PCA

        found = PCA(table, standardize=kind == "correlation", demean=True, normalize=False)
        # It standardises with n, R with n - 1; then a sum of squares is n times a variance.
        divisor = len(table) if kind == "correlation" else len(table) - 1
        return np.asarray(np.sqrt(found.eigenvals.to_numpy() / divisor))

    return [(OURS, "numpy", ours), ("scikit-learn", "sklearn", scikit), ("statsmodels", "statsmodels", statsmodels)]


def _maps(name: str, between: Dissimilarities, eigenvalues: list[float], stress: float, starts: int) -> Iterator[Case]:
    def ours(given: Dissimilarities) -> Floats:
        return np.array(classical_mds(given).eigenvalues[:2])

    def scikit(given: Dissimilarities) -> Floats:
        return np.array(
            sklearn("manifold").ClassicalMDS(n_components=2, metric="precomputed").fit(given.values).eigenvalues_[:2]
        )

    ways: list[Way] = [(OURS, "numpy", ours), ("scikit-learn", "sklearn", scikit)]
    kind = "relative, worst of two eigenvalues; against R"
    yield from _cases("classical map", name, ways, between, relative_error(np.array(eigenvalues[:2])), kind)

    def above(found: float) -> float:
        return max(0.0, found - stress) if math.isfinite(found) else math.nan

    kind = "stress-1 above the best of 62 runs of R's isoMDS and monoMDS"
    yield from _cases("non-metric map", name, _nonmetric_ways(starts), between, above, kind)


def _nonmetric_ways(starts: int) -> list[Way]:
    def ours(given: Dissimilarities) -> float:
        return nonmetric_mds(given, starts=starts).stress

    def scikit(given: Dissimilarities) -> float:
        made = sklearn("manifold").MDS(
            2,
            metric_mds=False,
            metric="precomputed",
            n_init=starts + 1,
            init="random",
            max_iter=1000,
            eps=1e-9,
            normalized_stress=True,
            random_state=0,
        )
        return float(made.fit(given.values).stress_)

    return [
        (f"{OURS} ({starts + 1} starts)", "numpy", ours),
        (f"scikit-learn ({starts + 1} starts)", "sklearn", scikit),
    ]


def _comparisons(truth: Any) -> Iterator[Case]:
    given = pd.DataFrame(truth["x"]), pd.DataFrame(truth["y"])
    for name, shift in (("eurodist and a noisy copy", 0.0), ("the same, offset 1e9", 1e9)):
        moved = given[0] + shift, given[1] + shift
        ways: list[Way] = [
            (OURS, "numpy", lambda pair: np.array([procrustes(*pair).m2])),
            ("scipy", "scipy", lambda pair: np.array([scipy_procrustes(*pair)[2]])),
        ]
        kind = "relative, m2; against R's vegan"
        yield from _cases("Procrustes", name, ways, moved, relative_error(np.array([truth["m2"]])), kind)


def _cases(
    title: str, name: str, ways: list[Way], given: Any, error: Callable[[Any], float], kind: str
) -> Iterator[Case]:
    size = len(given.labels) if isinstance(given, Dissimilarities) else len(given)
    for method, package, run in ways:
        if find_spec(package) is not None:
            yield Case(AREA, title, method, name, size, kind, quietly(run, given), error)

"""Figures of the spaces: each implementation's error beside its time, on R's answers and on shifted tables."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import procrustes as scipy_procrustes

from benchmarks.statistics.measuring import Way, comparison, relative_error
from palpate.analysis.spaces.classical import classical_mds
from palpate.analysis.spaces.components import pca
from palpate.analysis.spaces.dissimilarities import Dissimilarities, dissimilarities_of
from palpate.analysis.spaces.nonmetric import nonmetric_mds
from palpate.analysis.spaces.procrustes import procrustes
from palpate.analysis.statistics.doubles import Floats
from palpate.analysis.statistics.references import reference_table
from palpate.protocols.bench import Case

OURS = "palpate"
TRUTH = Path(__file__).with_name("spaces_truth.json")


def cases(quick: bool) -> Iterator[Case]:
    """Yield components, maps and their comparison; without `quick` also non-metric maps from more starts."""
    truth = json.loads(TRUTH.read_text())
    yield from _components(truth)
    for name in ("eurodist", "ekman"):
        reference = truth["sets"][name]
        frame = pd.DataFrame(reference["values"], index=reference["labels"], columns=reference["labels"])
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
        yield from comparison(
            title, f"attitude, {kind}", len(table), ways, table, error, "relative, worst SD; against R"
        )
        far = table + 1e9
        title = "principal components, offset 1e9"
        yield from comparison(
            title, f"attitude, {kind}", len(far), ways, far, error, "relative, worst SD; exact answer"
        )


def _component_ways(kind: Any) -> list[Way]:
    def ours(table: pd.DataFrame) -> Floats:
        return np.sqrt(pca(table, kind).variances)

    def scikit(table: pd.DataFrame) -> Floats:
        values = table.to_numpy()
        values = (values - values.mean(axis=0)) / values.std(axis=0, ddof=1) if kind == "correlation" else values
        return np.asarray(np.sqrt(sklearn("decomposition").PCA().fit(values).explained_variance_))

    def statsmodels(table: pd.DataFrame) -> Floats:
        from statsmodels.multivariate.pca import PCA

        fit = PCA(table, standardize=kind == "correlation", demean=True, normalize=False)
        # It standardises with n, R with n - 1; then a sum of squares is n times a variance.
        divisor = len(table) if kind == "correlation" else len(table) - 1
        return np.asarray(np.sqrt(fit.eigenvals.to_numpy() / divisor))

    return [(OURS, "numpy", ours), ("scikit-learn", "sklearn", scikit), ("statsmodels", "statsmodels", statsmodels)]


def _maps(name: str, between: Dissimilarities, eigenvalues: list[float], stress: float, starts: int) -> Iterator[Case]:
    def ours(distances: Dissimilarities) -> Floats:
        return np.array(classical_mds(distances).eigenvalues[:2])

    def scikit(distances: Dissimilarities) -> Floats:
        model = sklearn("manifold").ClassicalMDS(n_components=2, metric="precomputed")
        return np.array(model.fit(distances.values).eigenvalues_[:2])

    ways: list[Way] = [(OURS, "numpy", ours), ("scikit-learn", "sklearn", scikit)]
    kind, n = "relative, worst of two eigenvalues; against R", len(between.labels)
    yield from comparison("classical map", name, n, ways, between, relative_error(np.array(eigenvalues[:2])), kind)

    def above(value: float) -> float:
        return max(0.0, value - stress) if math.isfinite(value) else math.nan

    kind = "stress-1 above the best of 62 runs of R's isoMDS and monoMDS"
    yield from comparison("non-metric map", name, n, _nonmetric_ways(starts), between, above, kind)


def _nonmetric_ways(starts: int) -> list[Way]:
    def ours(distances: Dissimilarities) -> float:
        return nonmetric_mds(distances, starts=starts).stress

    def scikit(distances: Dissimilarities) -> float:
        model = sklearn("manifold").MDS(
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
        return float(model.fit(distances.values).stress_)

    return [
        (f"{OURS} ({starts + 1} starts)", "numpy", ours),
        (f"scikit-learn ({starts + 1} starts)", "sklearn", scikit),
    ]


def _comparisons(truth: Any) -> Iterator[Case]:
    tables = pd.DataFrame(truth["x"]), pd.DataFrame(truth["y"])
    for name, shift in (("eurodist and a noisy copy", 0.0), ("the same, offset 1e9", 1e9)):
        moved = tables[0] + shift, tables[1] + shift
        ways: list[Way] = [
            (OURS, "numpy", lambda pair: np.array([procrustes(*pair).m2])),
            ("scipy", "scipy", lambda pair: np.array([scipy_procrustes(*pair)[2]])),
        ]
        kind = "relative, m2; against R's vegan"
        yield from comparison(
            "Procrustes", name, len(moved), ways, moved, relative_error(np.array([truth["m2"]])), kind
        )

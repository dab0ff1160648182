"""Folds of a whole study by the thesis' network, in sequence and by Dask workers: what all fifty would take."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from operator import attrgetter
from pathlib import Path

import numpy as np

from benchmarks.attributes.material import WHOLE, WHOLE_PICTURES, WHOLE_SEGMENTS, random_material
from palpate.modeling.attributes.entries import PROPOSED, Own
from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation, AttributeOptions, evaluate_methods
from palpate.modeling.attributes.material import Material
from palpate.modeling.attributes.methods import Method
from palpate.modeling.training.jobs import local_cluster
from palpate.protocols.bench import Case

AREA = "textures"
WORKERS = 2
"""Number of Dask workers and of folds: each worker has one fold."""


def method_name(method: str) -> str:
    """Return a method's name in the table; the proposed one is marked."""
    return f"palpate, {method}" if method == PROPOSED else method


def whole_folds(methods: Mapping[str, Method], own: Own) -> Iterator[Case]:
    """Yield two of the fifty folds, trained with the method's own epochs; the evaluation has 25 times as many."""
    if PROPOSED not in methods:
        return
    material = random_material(WHOLE, WHOLE_SEGMENTS, WHOLE_PICTURES, seed=1)
    input_name = f"{WHOLE} made-up textures, {WHOLE_SEGMENTS} segments, {WHOLE_PICTURES} pictures each"
    for way, workers in (("one after another", 0), (f"{WORKERS} Dask workers", WORKERS)):
        run = partial(_evaluate, material, methods, own, workers)
        yield Case(
            AREA, f"{WORKERS} folds of a study, training and answers", f"{method_name(PROPOSED)}, {way}",
            input_name, WORKERS, "MAE of textures left out, 0 to 100", run, _error, seconds=attrgetter("seconds"),
        )  # fmt: skip


def _evaluate(material: Material, methods: Mapping[str, Method], own: Own, workers: int) -> AttributeEvaluation:
    """Evaluate in a new folder, so that no cached results are used."""
    with tempfile.TemporaryDirectory() as folder, _workers(workers, Path(folder, "workers")) as cluster:
        options = AttributeOptions(
            work=Path(folder), methods=(PROPOSED,), ablations=False, folds=WORKERS, workers=1, cluster=cluster
        )
        return evaluate_methods(material, options, methods, own)


def _workers(count: int, scratch: Path) -> AbstractContextManager[str | None]:
    return local_cluster(count, scratch) if count else nullcontext()


def _error(evaluation: AttributeEvaluation) -> float | None:
    entry = evaluation.main(PROPOSED)
    if entry is None or evaluation.refused(entry):
        return None
    return float(np.abs(evaluation.predicted(entry) - evaluation.rated()).mean())

"""Figures of predicted attributes: errors on textures left out, beside the times of training and prediction.

The textures are few and synthetic. Everything is evaluated once, before the first row, by one process per core; rows
about training have the seconds that were measured then.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

from benchmarks.attributes.folds import AREA, method_name, whole_folds
from benchmarks.attributes.material import WHOLE_PICTURES, WHOLE_SEGMENTS, random_material
from benchmarks.precomputed import constant, precomputed_case
from palpate.modeling.attributes.domain import learning, mean_of_rows
from palpate.modeling.attributes.entries import Entry, Own
from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation, AttributeOptions, evaluate_methods
from palpate.modeling.attributes.evaluation.tables import features_of, method_rows
from palpate.modeling.attributes.folds import whole_fold
from palpate.modeling.attributes.material import Material, Texture
from palpate.modeling.attributes.methods import Method
from palpate.modeling.attributes.model_file import AttributeModel, Saveable, read_model, write_model
from palpate.modeling.training.threads import limited
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

QUICK_TEXTURES, TEXTURES, SEGMENTS, PICTURES = 8, 16, 24, 4
LEFT_OUT = 8
"""Number of textures that are left out, one at a time: all sixteen would take twice as long."""
PREDICTIONS = 50
"""Number of predictions that are computed at once, each of one segment and one picture."""


@dataclass(frozen=True)
class EvaluatedMethods:
    """The results of one evaluation, and the textures to predict."""

    evaluation: AttributeEvaluation
    folder: Path
    fifty: Material
    whole: Material

    @property
    def input_name(self) -> str:
        """The data, as named in a row."""
        textures, left_out = len(self.evaluation.material.textures), len(self.evaluation.tested)
        epochs = "few" if self.evaluation.options.quick else "own"
        return f"{textures} made-up textures, {left_out} left out, {epochs} epochs"


def cases(
    quick: bool, methods: Mapping[str, Method] | None = None, own: Own | None = None, workers: int | None = None
) -> Iterator[Case]:
    """Yield every figure of this area: eight textures left out, or five if `quick`, with few epochs of networks."""
    from palpate.modeling.attributes.registry import METHODS, OWN_FEATURES

    every, features = METHODS if methods is None else methods, OWN_FEATURES if own is None else own
    with tempfile.TemporaryDirectory() as folder:
        material = random_material(QUICK_TEXTURES if quick else TEXTURES, SEGMENTS, PICTURES)
        options = AttributeOptions(work=Path(folder), ablations=False, quick=quick, workers=workers, folds=LEFT_OUT)
        evaluation = evaluate_methods(material, options, every, features)
        whole = random_material(1, WHOLE_SEGMENTS, WHOLE_PICTURES, seed=1)
        evaluated = EvaluatedMethods(evaluation, Path(folder), random_material(PREDICTIONS, 1, 1, seed=1), whole)
        yield from _trainings(evaluated)
        yield from _answers(evaluated)
    if not quick:
        yield from whole_folds(every, features)


def _trainings(evaluated: EvaluatedMethods) -> Iterator[Case]:
    kind = "MAE of textures left out, 0 to 100; time of a fold's training"
    case, n = "attributes of a texture left out", len(evaluated.evaluation.tested)
    for row in method_rows(evaluated.evaluation):
        method, seconds = method_name(row["method"]), row["train_s"] or 0.0
        yield precomputed_case(AREA, case, method, evaluated.input_name, n, kind, row["mae"], seconds)


def _answers(evaluated: EvaluatedMethods) -> Iterator[Case]:
    """Yield each method's prediction from features to attributes, from its file: 50 rows, and one whole texture."""
    evaluation, kind = evaluated.evaluation, "MAE of textures left out, 0 to 100"
    rows = [(row, evaluation.main(row["method"])) for row in method_rows(evaluation) if row["mae"] is not None]
    models = [(row, _from_file(evaluated, entry)) for row, entry in rows if entry is not None]
    whole = f"a texture of {WHOLE_SEGMENTS} segments and {WHOLE_PICTURES} pictures"
    for case, material in (("50 predictions, of a segment and a picture", evaluated.fifty), (whole, evaluated.whole)):
        for row, model in models:
            run = partial(predict_all, model, material.textures, len(material.attributes))
            yield Case(AREA, case, method_name(row["method"]), evaluated.input_name, len(material.textures), kind, run,
                       constant(row["mae"]))  # fmt: skip


def predict_all(model: AttributeModel, textures: Sequence[Texture], attributes: int) -> list[Array]:
    """Return every texture's prediction as the library computes it: all at once, with one thread."""
    with limited(1):
        predictions = model.predictions(textures)
        return [mean_of_rows(rows, texture, attributes)[0] for rows, texture in zip(predictions, textures, strict=True)]


def _from_file(evaluated: EvaluatedMethods, entry: Entry) -> AttributeModel:
    """Return the method fitted to all textures, written to a file and read back."""
    evaluation, methods = evaluated.evaluation, evaluated.evaluation.domain.methods
    method, settings = evaluation.method(entry), evaluation.options.settings
    with limited(1):
        fold = whole_fold(evaluation.material)
        fitted = method.fit(learning(evaluation.material, fold, method, entry, evaluation.options.seed, settings))
    card: dict[str, Any] = {
        "name": f"bench-{entry.method}", "title": features_of(entry), "method": entry.method,
        "attributes": tuple((pair.low, pair.high) for pair in evaluation.material.attributes),
    }  # fmt: skip
    return read_model(write_model(evaluated.folder, cast(Saveable, fitted), card, methods), methods)

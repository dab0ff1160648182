"""Figures of predicted attributes: every method's error on textures left out, beside the time of training and answer.

On textures that are made up, in small. Everything is judged once, before the first row, by as many processes as there
are cores; the rows of the trainings hold the seconds that were taken while they ran.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

from benchmarks.attributes.folds import AREA, named, whole_folds
from benchmarks.attributes.material import WHOLE_PICTURES, WHOLE_SEGMENTS, made_up
from palpate.modeling.attributes.domain import learning, mean_of_rows
from palpate.modeling.attributes.entries import Entry, Own
from palpate.modeling.attributes.evaluation.evaluate import AttributeEvaluation, AttributeOptions, evaluate_methods
from palpate.modeling.attributes.evaluation.tables import Row, features_of, method_rows
from palpate.modeling.attributes.folds import all_of_them
from palpate.modeling.attributes.material import Material, Texture
from palpate.modeling.attributes.methods import Method
from palpate.modeling.attributes.model_file import AttributeModel, Saveable, read_model, write_model
from palpate.modeling.training.threads import limited
from palpate.protocols.bench import Case
from palpate.signals.arrays import Array

QUICK_TEXTURES, TEXTURES, SEGMENTS, PICTURES = 8, 16, 24, 4
LEFT_OUT = 8
"""So many of them are left out, each once: all sixteen would take twice as long."""
ASKED = 50
"""So many predictions are asked for at once: of one segment and one picture of each of so many textures."""


@dataclass(frozen=True)
class Found:
    """The results of one evaluation, and the textures to predict."""

    evaluation: AttributeEvaluation
    folder: Path
    asked: Material
    whole: Material

    @property
    def given(self) -> str:
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
        material = made_up(QUICK_TEXTURES if quick else TEXTURES, SEGMENTS, PICTURES)
        options = AttributeOptions(work=Path(folder), ablations=False, quick=quick, workers=workers, folds=LEFT_OUT)
        evaluation = evaluate_methods(material, options, every, features)
        whole = made_up(1, WHOLE_SEGMENTS, WHOLE_PICTURES, seed=1)
        found = Found(evaluation, Path(folder), made_up(ASKED, 1, 1, seed=1), whole)
        yield from _trainings(found)
        yield from _answers(found)
    if not quick:
        yield from whole_folds(every, features)


def _trainings(found: Found) -> Iterator[Case]:
    kind = "MAE of textures left out, 0 to 100; time of a fold's training"
    for row in method_rows(found.evaluation):
        seconds = partial(_taken, row["train_s"] or 0.0)
        yield _case(found, "attributes of a texture left out", row, kind, _nothing, seconds)


def _answers(found: Found) -> Iterator[Case]:
    """Yield each method's answers from features to attributes, from its file: 50 rows, and one whole texture."""
    evaluation, kind = found.evaluation, "MAE of textures left out, 0 to 100"
    rows = [(row, evaluation.main(row["method"])) for row in method_rows(evaluation) if row["mae"] is not None]
    models = [(row, _from_file(found, entry)) for row, entry in rows if entry is not None]
    whole = f"a texture of {WHOLE_SEGMENTS} segments and {WHOLE_PICTURES} pictures"
    for case, of in (("50 predictions, of a segment and a picture", found.asked), (whole, found.whole)):
        for row, model in models:
            run = partial(asked, model, of.textures, len(of.attributes))
            yield replace(_case(found, case, row, kind, run), n=len(of.textures))


def asked(model: AttributeModel, textures: Sequence[Texture], attributes: int) -> list[Array]:
    """Return every texture's prediction, as the library makes it: all at once, with one thread."""
    with limited(1):
        said = model.predictions(textures)
        return [mean_of_rows(rows, each, attributes)[0] for rows, each in zip(said, textures, strict=True)]


def _from_file(found: Found, entry: Entry) -> AttributeModel:
    """Return the method fitted to all, written to a file and read back."""
    evaluation, methods = found.evaluation, found.evaluation.domain.methods
    method, settings = evaluation.method(entry), evaluation.options.settings
    with limited(1):
        fold = all_of_them(evaluation.material)
        fitted = method.fit(learning(evaluation.material, fold, method, entry, evaluation.options.seed, settings))
    card: dict[str, Any] = {
        "name": f"bench-{entry.method}", "title": features_of(entry), "method": entry.method,
        "attributes": tuple((pair.low, pair.high) for pair in evaluation.material.attributes),
    }  # fmt: skip
    return read_model(write_model(found.folder, cast(Saveable, fitted), card, methods), methods)


def _case(
    found: Found, case: str, row: Row, kind: str, run: Callable[[], object],
    seconds: Callable[[object], float] | None = None,
) -> Case:  # fmt: skip
    told = partial(_told, row["mae"])
    return Case(
        AREA, case, named(row["method"]), found.given, len(found.evaluation.tested), kind, run, told, seconds=seconds
    )


def _told(error: float | None, _answer: object) -> float | None:
    return error


def _nothing() -> None:
    """Do nothing: there is nothing to run again."""


def _taken(seconds: float, _answer: object) -> float:
    return seconds

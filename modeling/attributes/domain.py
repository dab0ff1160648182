"""The jobs of an evaluation: fit a method without one texture, and predict that texture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.attributes.entries import Entry
from palpate.modeling.attributes.folds import Fold
from palpate.modeling.attributes.material import Material, MaterialError, Pair, Texture, load_material
from palpate.modeling.attributes.methods import Fitted, Learning, Method
from palpate.modeling.evaluate.engine import Domain, Result
from palpate.modeling.training.history import curve_of
from palpate.protocols.code_digest import code_digest, module_of
from palpate.signals.arrays import Array

LOW, HIGH = 0.0, 100.0


@dataclass(frozen=True)
class LeaveOut:
    """A job: fit an entry without the texture `test`, then predict it."""

    entry: Entry
    test: str

    @property
    def name(self) -> str:
        """The job's name in progress reports and errors."""
        return f"{self.entry.name}, without {self.test}"


@dataclass(frozen=True, kw_only=True)
class AttributeDomain(Domain[LeaveOut]):
    """The textures, the folds and the methods.

    The textures are a file in `work` that each process reads once; `digest` is that of the whole file, and `parts` are
    those of each texture and kind of feature, so that a result stays valid while the data of its job are the same.
    """

    work: Path
    digest: str
    parts: Mapping[str, str]
    attributes: tuple[Pair, ...]
    folds: Mapping[str, Fold]
    methods: Mapping[str, Method]

    def compute(self, job: LeaveOut) -> Result[LeaveOut]:
        """Return the prediction and its SD over the texture's rows, both (attributes,) on 0..100.

        The result also has the learning curve, the seconds of the fit (train_s) and of the prediction (asked_s), and
        the number of rows.
        """
        material, method = load_material(self.work, self.digest), self.methods[job.entry.method]
        data = learning(material, self.folds[job.test], method, job.entry, self.seed, self.settings)
        tested = textures_named(material, (job.test,))[0]
        start = self.clock()
        model = method.fit(data)
        fitted = self.clock()
        predicted, spread, rows = predict_texture(model, tested, len(material.attributes))
        predict_s = self.clock() - fitted
        train_s = getattr(getattr(model, "trained", None), "seconds", fitted - start)
        numbers = {"train_s": float(train_s), "asked_s": predict_s, "rows": float(rows)}
        return Result(job, numbers, {"predicted": predicted, "spread": spread, **curve_of(model)})

    def decides(self, job: LeaveOut) -> dict[str, Any]:
        """Return all that a result depends on: method, fold, the textures' digests, seed, settings and code."""
        entry, fold, method = job.entry, self.folds[job.test], self.methods[job.entry.method]
        kinds = [f"touch/{kind}" for kind in entry.touch]
        kinds += [f"{where}/{kind}" for kind in entry.sight for where in ("sight", "variants")]
        return {
            "job": [entry.method, entry.touch, entry.sight, method.name, method.holds(self.settings)],
            "fold": [fold.test, fold.train, fold.held],
            "textures": {
                name: [self.parts[name], *(self.parts.get(f"{name}/{kind}", "") for kind in kinds)]
                for name in (*fold.train, *fold.held, fold.test)
            },
            "attributes": [[pair.low, pair.high] for pair in self.attributes],
            "seed": self.seed,
            "settings": self.plain_settings(),
            "code": code_digest(module_of(method.fit), __name__),
        }


def learning(
    material: Material, fold: Fold, method: Method, entry: Entry, seed: int, settings: Mapping[str, Any]
) -> Learning:
    """Return a method's data in a fold; a method that does not watch held textures learns from these too."""
    train, held = (fold.train, fold.held) if method.holds(settings) else (fold.known, ())
    return Learning(
        train=textures_named(material, train),
        held=textures_named(material, held),
        attributes=material.attributes,
        touch=entry.touch,
        sight=entry.sight,
        seed=seed,
        settings=settings,
    )


def textures_named(material: Material, names: Sequence[str]) -> tuple[Texture, ...]:
    """Return the textures with these names, in the order of the names."""
    known = {texture.id: texture for texture in material.textures}
    return tuple(known[name] for name in names)


def predict_texture(model: Fitted, texture: Texture, attributes: int) -> tuple[Array, Array, int]:
    """Return a texture's prediction and its SD over the rows, both (attributes,) on 0..100, and the number of rows.

    Raises MaterialError for predictions of another shape, or not finite.
    """
    return mean_of_rows(model.predict(texture), texture, attributes)


def mean_of_rows(prediction: Array | MaterialError, texture: Texture, attributes: int) -> tuple[Array, Array, int]:
    """Return the mean of predicted rows (n, attributes), clipped to 0..100, their SD, and n.

    Raises `prediction` where it is an error, and MaterialError for another shape or numbers that are not finite.
    """
    if isinstance(prediction, MaterialError):
        raise prediction
    rows = np.asarray(prediction, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != attributes or not len(rows):
        raise MaterialError(f"{texture.id}: the answer is {rows.shape}; (rows, {attributes}) is expected.")
    if not np.isfinite(rows).all():
        raise MaterialError(f"{texture.id}: the answer is not finite.")
    return np.clip(rows.mean(axis=0), LOW, HIGH), rows.std(axis=0), len(rows)

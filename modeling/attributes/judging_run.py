"""Running one job of leaving one texture out, or taking it from those that are finished."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.attributes.folds import Fold
from palpate.modeling.attributes.judging_jobs import Context, Done, Entry, Job
from palpate.modeling.attributes.judging_kept import keep, load
from palpate.modeling.attributes.judging_material import reread
from palpate.modeling.attributes.material import Material, MaterialError, Texture
from palpate.modeling.attributes.methods import Fitted, Learning, Method
from palpate.modeling.training.history import curve_of
from palpate.signals.arrays import Array

LOW, HIGH = 0.0, 100.0
Arrays = dict[str, NDArray[Any]]


def run(job: Job, context: Context) -> Done:
    """The job's result: the kept one of an equal job, else computed and kept.

    What refuses its textures (a ValueError) is a result too: it says why, and the other jobs go on.
    """
    if (found := load(job, context)) is not None:
        return found
    try:
        done = _computed(job, context)
    except ValueError as refusal:
        return Done(job, refused=str(refusal))
    keep(done, context)
    return done


def _computed(job: Job, context: Context) -> Done:
    material, method = reread(context.stored), context.methods[job.entry.method]
    given = learning(material, context.folds[job.test], method, job.entry, context.seed, context.settings)
    tested = named(material, (job.test,))[0]
    start = context.clock()
    model = method.fit(given)
    fitted = context.clock()
    predicted, spread, rows = answer(model, tested, len(material.attributes))
    asked = context.clock() - fitted
    took = getattr(getattr(model, "trained", None), "seconds", fitted - start)
    numbers = {"train_s": float(took), "asked_s": asked, "rows": float(rows)}
    return Done(job, numbers, {"predicted": predicted, "spread": spread, **curve_of(model)})


def learning(
    material: Material, fold: Fold, method: Method, entry: Entry, seed: int, settings: Mapping[str, Any]
) -> Learning:
    """What the method may learn from in this fold; one that does not watch `held` learns from these too."""
    train, held = (fold.train, fold.held) if method.holds(settings) else (fold.known, ())
    return Learning(
        train=named(material, train),
        held=named(material, held),
        attributes=material.attributes,
        touch=entry.touch,
        sight=entry.sight,
        seed=seed,
        settings=settings,
    )


def named(material: Material, names: Sequence[str]) -> tuple[Texture, ...]:
    """The textures of these names, in their order."""
    known = {each.id: each for each in material.textures}
    return tuple(known[name] for name in names)


def answer(model: Fitted, texture: Texture, attributes: int) -> tuple[Array, Array, int]:
    """A texture's prediction and its SD over the rows, both (attributes,) on 0..100, and how many rows there were.

    Raises MaterialError for an answer of another shape, or one that is not finite.
    """
    return summed_up(model.predict(texture), texture, attributes)


def summed_up(said: Array | MaterialError, texture: Texture, attributes: int) -> tuple[Array, Array, int]:
    """`answer` from the rows that a model said: their mean; what lies beyond an end of the scale is that end."""
    if isinstance(said, MaterialError):
        raise said
    rows = np.asarray(said, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != attributes or not len(rows):
        raise MaterialError(f"{texture.id}: the answer is {rows.shape}; (rows, {attributes}) is expected.")
    if not np.isfinite(rows).all():
        raise MaterialError(f"{texture.id}: the answer is not finite.")
    return np.clip(rows.mean(axis=0), LOW, HIGH), rows.std(axis=0), len(rows)

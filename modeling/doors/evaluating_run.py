"""Running one job of an evaluation, or taking it from those that are finished."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.modeling.doors.data import ModelDataError
from palpate.modeling.doors.evaluating_files import as_file
from palpate.modeling.doors.evaluating_jobs import WHOLE, Context, Done, Job, data_of, learning
from palpate.modeling.doors.evaluating_kept import checkpoint, forget_checkpoints, keep, load
from palpate.modeling.doors.evaluating_made import at_the_ends, made
from palpate.modeling.doors.methods import Fitted
from palpate.modeling.training.history import curve_of

Arrays = dict[str, NDArray[Any]]


def run(job: Job, context: Context) -> Done:
    """The job's result: the kept one of an equal job, else computed and kept."""
    if (found := load(job, context)) is not None:
        return found
    done = _computed(job, context)
    keep(done, context)
    if job.direction == "inverse" and job.split != WHOLE:  # a forward network's is what the inverse ones build on
        forget_checkpoints(job, context)
    return done


def _computed(job: Job, context: Context) -> Done:
    model, numbers = trained(job, context)
    fold = context.splits[job.split][job.fold]
    test = data_of(context, job.split).rows(fold.test)
    given = test.force_N if job.direction == "forward" else context.scaling.rating_up(test.rating)
    start = context.clock()
    predicted = model.predict(given)
    numbers = {**numbers, "asked_s": context.clock() - start}
    arrays: Arrays = {"test": np.asarray(fold.test), "predicted": predicted, **curve_of(model)}
    if hasattr(model, "deviation"):
        arrays["deviation"] = model.deviation(given)
    if job.direction == "inverse" and job.split == context.full:
        further, counted = _made(job, context, model, arrays["predicted"])
        arrays, numbers = {**arrays, **further}, {**numbers, **counted}
    notes: tuple[str, ...] = ()
    if job.fold == 0 and job.split == context.full:
        try:
            numbers = {**numbers, **as_file(context, model, job, given)}
        except ModelDataError as refusal:
            notes = (str(refusal),)
    return Done(job, arrays, numbers, notes)


def with_below(job: Job, context: Context) -> tuple[Job, ...]:
    """The job, and that of the forward method that it builds on, where it does."""
    below = context.methods[job.direction][job.method].needs_forward
    return (job,) if below is None else (job, Job("forward", below, job.split, job.fold))


def trained(
    job: Job, context: Context, known: Mapping[Job, tuple[Fitted, dict[str, float]]] = MappingProxyType({})
) -> tuple[Fitted, dict[str, float]]:
    """The fitted method and the seconds of its training; those of the forward model that it builds on beside them.

    A forward network that its own job has trained is taken from its checkpoint, so it is trained once; `known` are
    answers of this function that it need not find again.
    """
    method = context.methods[job.direction][job.method]
    given, below_s = learning(context, job, method, checkpoint(job, context)), 0.0
    for lower in with_below(job, context)[1:]:
        below, seconds = known[lower] if lower in known else trained(lower, context)
        given, below_s = replace(given, forward=below), seconds["train_s"]
    start = context.clock()
    model = method.fit(given)
    took = context.clock() - start
    return model, {"train_s": getattr(getattr(model, "trained", None), "seconds", took), "forward_s": below_s}


def _made(job: Job, context: Context, model: Fitted, made_N: NDArray[Any]) -> tuple[Arrays, dict[str, float]]:
    """The loop and the plausibility; in the first fold also what comes of extreme wishes."""
    over, fold = data_of(context, job.split), context.splits[job.split][job.fold]
    judge, _ = trained(Job("forward", context.judge, job.split, job.fold), context)
    test, known_N = over.rows(fold.test), over.force_N[fold.train]
    found = made(context, test, made_N, known_N, judge)
    if job.fold > 0:
        return found, {}
    further, numbers = at_the_ends(context, test, model, known_N, judge)
    return {**found, **further}, numbers

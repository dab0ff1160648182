"""An evaluation of predicted attributes as a whole: every method without each texture once, on the same folds."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.attributes.folds import LEAST, leave_one_texture_out, some_of
from palpate.modeling.attributes.judging_entries import ON_REQUEST, Own, entries
from palpate.modeling.attributes.judging_jobs import MAIN, Context, Done, Entry, Job
from palpate.modeling.attributes.judging_kept import keep, load
from palpate.modeling.attributes.judging_material import digest_of, parts_of, stored
from palpate.modeling.attributes.judging_run import named, run
from palpate.modeling.attributes.lacking import has_rows, senses, why_of
from palpate.modeling.attributes.material import Material, MaterialError, ratings_of
from palpate.modeling.attributes.methods import Method
from palpate.protocols.progress import Clock, Report
from palpate.signals.arrays import Array

QUICK_TEXTURES = 5


@dataclass(frozen=True)
class Wanted:
    """What is evaluated, and how.

    `work` is the folder of finished jobs and of the textures as workers read them. `methods` None: all but
    `ON_REQUEST`. `ablations`: Tables 3.4 and 3.5 too. `quick`: five textures are left out, and methods have few
    epochs. `epochs` None: their own. `folds`: so many textures are left out, in turn from each class (None: each of
    them); `quick` goes before it. `early_stopping`: the thesis' network and its halves watch textures too, as the
    baselines do.
    """

    work: Path
    methods: tuple[str, ...] | None = None
    ablations: bool = True
    seed: int = 0
    quick: bool = False
    epochs: int | None = None
    workers: int | None = None
    cluster: str | None = None
    folds: int | None = None
    early_stopping: bool = False

    @property
    def settings(self) -> dict[str, Any]:
        """What goes to the methods: one thread for each job, and what was asked for."""
        told = {"quick": self.quick or None, "epochs": self.epochs, "early_stopping": self.early_stopping or None}
        return {"threads": 1, **{name: value for name, value in told.items() if value is not None}}


@dataclass(frozen=True)
class Judged:
    """All results.

    `times` are seconds of making a kind of feature for one texture, by kind, where they were taken; `left_out` are
    textures that were not used, and why.
    """

    material: Material
    context: Context
    wanted: Wanted
    entries: tuple[Entry, ...]
    results: Mapping[Job, Done]
    seconds: float
    taken: int
    times: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def watching(self) -> bool:
        """Whether one of the methods watches textures to stop early."""
        return any(self.method(entry).holds(self.wanted.settings) for entry in self.entries)

    @property
    def tested(self) -> tuple[str, ...]:
        """The textures that were left out once each, in the material's order."""
        return tuple(self.context.folds)

    def method(self, entry: Entry) -> Method:
        """An entry's method."""
        return self.context.methods[entry.method]

    def of(self, table: str) -> tuple[Entry, ...]:
        """The entries that stand in a table."""
        return tuple(each for each in self.entries if table in each.tables)

    def main(self, method: str) -> Entry | None:
        """A method with its own features."""
        return next((each for each in self.of(MAIN) if each.method == method), None)

    def done(self, entry: Entry) -> list[Done]:
        """An entry's results, in the order of `tested`."""
        return [self.results[Job(entry, test)] for test in self.tested]

    def refused(self, entry: Entry) -> str:
        """Why an entry was refused, "" where it was not: one texture is enough."""
        return next((each.refused for each in self.done(entry) if each.refused), "")

    def predicted(self, entry: Entry) -> Array:
        """(tested, attributes) on 0..100, of an entry that was not refused."""
        return np.stack([each.predicted for each in self.done(entry)])

    def rated(self) -> Array:
        """(tested, attributes) on 0..100."""
        return ratings_of(named(self.material, self.tested))

    def unused(self) -> list[str]:
        """The textures that were not used, by why: "T02, T05: it was not rated"."""
        return by_reason(self.left_out)

    def groups(self) -> tuple[int, ...]:
        """A number for each tested texture; those that share content have the same."""
        first = [min(each.test, *each.apart) if each.apart else each.test for each in self.context.folds.values()]
        return tuple(sorted(set(first)).index(each) for each in first)


def usable(material: Material) -> tuple[Material, dict[str, str]]:
    """The textures that all methods can be compared on, and why the others are not used.

    They were rated; and where some were recorded, so were they, and where some have pictures, so have they. Raises
    MaterialError where nothing was rated, and where fewer are left than can be evaluated: it names what lacks.
    """
    rated = material.rated()
    felt, seen = senses(rated.textures)
    left_out = {each.id: "it was not rated" for each in material.textures if each.rated is None}
    for each in rated.textures:
        lacks = [what for what, asked, own in (("recording", felt, each.touch), ("picture", seen, each.sight))
                 if asked and not has_rows(own)]  # fmt: skip
        if lacks:
            why = [note for what in lacks for note in why_of(each, what)]
            told = f"no {' and no '.join(lacks)} of it can be used"
            left_out[each.id] = f"{told} ({'; '.join(why)})" if why else told
    kept = tuple(each for each in rated.textures if each.id not in left_out)
    if len(kept) < LEAST <= len(material.textures):
        raise MaterialError(
            f"{len(kept)} of {len(material.textures)} textures have all that the others have, {LEAST} at least are"
            f" needed. {'; '.join(by_reason(left_out))}. Record, photograph and rate the same textures."
        )
    return replace(rated, textures=kept), left_out


def by_reason(left_out: Mapping[str, str]) -> list[str]:
    """Textures that are not used, those of one reason in one line."""
    names: dict[str, list[str]] = {}
    for name, why in left_out.items():
        names.setdefault(why, []).append(name)
    return [f"{', '.join(some)}: {why}" for why, some in names.items()]


def context_for(
    material: Material, wanted: Wanted, methods: Mapping[str, Method], clock: Clock = time.perf_counter
) -> Context:
    """What all jobs share. Raises MaterialError where too few textures were rated."""
    rated, _ = usable(material)
    count = QUICK_TEXTURES if wanted.quick else wanted.folds
    only = None if count is None else some_of({each.id: each.category for each in rated.textures}, count, wanted.seed)
    folds = leave_one_texture_out(rated, wanted.seed, only=only)
    return Context(
        stored=stored(rated, wanted.work),
        digest=digest_of(rated),
        parts=parts_of(rated),
        attributes=rated.attributes,
        folds={each.test: each for each in folds},
        methods=methods,
        seed=wanted.seed,
        settings=wanted.settings,
        work=wanted.work,
        clock=clock,
    )


def demand_known(names: Sequence[str], methods: Mapping[str, Method]) -> None:
    """Raises MaterialError for a method that is none."""
    unknown = [name for name in names if name not in methods]
    if unknown:
        from palpate.protocols.did_you_mean import nearest

        raise MaterialError(f"no method {unknown[0]!r}; {nearest(unknown[0], methods)}")


def judge(
    material: Material, wanted: Wanted, methods: Mapping[str, Method], own: Own, report: Report = lambda _line: None,
    times: Mapping[str, float] | None = None, clock: Clock = time.perf_counter,
) -> Judged:  # fmt: skip
    """Fit every entry without each texture and ask it about that one.

    Raises MaterialError for an unknown method or too few textures, JobBroken for what fails other than by refusing.
    """
    demand_known(wanted.methods or (), methods)
    start = clock()
    context = context_for(material, wanted, methods, clock)
    chosen = [name for name in methods if name not in ON_REQUEST] if wanted.methods is None else wanted.methods
    names = tuple(name for name in methods if name in chosen)
    every = entries(names, methods, own, wanted.ablations)
    jobs = [Job(entry, test) for entry in every for test in context.folds]
    results = {job: found for job in jobs if (found := load(job, context)) is not None}
    taken = len(results)
    results |= _computed([job for job in jobs if job not in results], context, wanted, report)
    kept, left_out = usable(material)
    return Judged(kept, context, wanted, every, results, clock() - start, taken, times or {}, left_out)


def _computed(jobs: Sequence[Job], context: Context, wanted: Wanted, report: Report) -> dict[Job, Done]:
    """What is trained in epochs goes first, so that no core is left with a long one at the end."""
    from palpate.modeling.training.jobs import run_jobs

    if not jobs:
        return {}
    ordered = sorted(jobs, key=lambda job: not context.methods[job.entry.method].in_epochs)
    answers = run_jobs(
        partial(run, context=context), ordered, workers=wanted.workers, cluster=wanted.cluster, report=report
    )
    for each in answers:
        if load(each.job, context) is None:
            keep(each, context)
    return dict(zip(ordered, answers, strict=True))

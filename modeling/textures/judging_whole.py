"""An evaluation of textures as a whole: every method on every texture, one step ahead and running free."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from palpate.modeling.textures.judging import ceiling, truth_of
from palpate.modeling.textures.judging_drive import Drive
from palpate.modeling.textures.judging_jobs import QUICK_SECONDS, SECONDS, Context, Done, Explore, Fit, Job, Play
from palpate.modeling.textures.judging_kept import forget_checkpoints, keep, load
from palpate.modeling.textures.judging_run import drive_for, run
from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from palpate.modeling.textures.registry import DEFAULT, METHODS, ON_REQUEST, demand_known
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.modeling.textures.splitting import split, told
from palpate.modeling.textures.windows import LENGTHS
from palpate.protocols.progress import Clock, Report
from palpate.signals.textures.timing import step_us

LOSSES = ("mae", "mse", "huber-1.2", "huber-1.6", "huber-2.0")
"""Figure 4.5 (the names are those of palpate.modeling.textures.heads)."""
STEPS, QUICK_STEPS = 2000, 200
SLOW = ("dstn", "hapinf", "gan", "foten", "foten_thesis", "foten_generative", "ten", "ten_mfcc", "ten_wavelet")
"""What takes minutes to train goes first, so that no core is left with a long one at the end."""
Steps = Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True)
class Wanted:
    """What is evaluated, and how.

    `methods` None: all but `ON_REQUEST`. `explore`: the surfaces are simulated, and another exploration drives the
    models. `grid`: the methods whose windows and losses are compared too (Figure 4.5, Table 4.2). `workers` and
    `cluster` as `run_jobs` takes them; `work` is the folder of finished jobs. `settings` go to the methods as they
    are.
    """

    work: Path
    methods: tuple[str, ...] | None = None
    explore: bool = False
    grid: tuple[str, ...] = ()
    seed: int = 0
    quick: bool = False
    settings: Mapping[str, Any] = field(default_factory=dict)
    workers: int | None = None
    cluster: str | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The methods in the registry's order."""
        chosen = [name for name in METHODS if name not in ON_REQUEST] if self.methods is None else self.methods
        return tuple(name for name in METHODS if name in chosen)


@dataclass(frozen=True)
class Judged:
    """All results: fits, what ran free, what drove it, and the time of a step by runtime for each method."""

    context: Context
    wanted: Wanted
    fits: Mapping[Fit, Done]
    plays: Mapping[Play, Done]
    drives: Mapping[str, Drive]
    ceilings: Mapping[str, Mapping[str, float | None]]
    truths: Mapping[str, Mapping[str, float | None]]
    steps: Mapping[str, Steps]
    notes: Mapping[str, tuple[str, ...]]
    seconds: float
    jobs: int
    taken: int

    @property
    def textures(self) -> tuple[str, ...]:
        """In the order of the recordings."""
        return tuple(self.context.recordings)

    def method(self, name: str) -> Method:
        """One of the methods."""
        return self.context.methods[name]


def context_for(
    recordings: Sequence[Recording], simulator: TextureSimulator, wanted: Wanted,
    methods: Mapping[str, Method] = METHODS, clock: Clock = time.perf_counter,
) -> Context:  # fmt: skip
    """What all jobs share. A recording that cannot be split is left out.

    Raises TextureDataError for two recordings of one name, and where none can be split.
    """
    demand_known(wanted.methods or ())
    by_name = {each.texture: each for each in recordings}
    if not recordings or len(by_name) < len(recordings):
        raise TextureDataError("recordings of different textures are expected: at least one, and one of each.")
    parts, left_out = _split(by_name, wanted.seed)
    return Context(
        recordings={name: by_name[name] for name in parts},
        parts=parts,
        left_out=left_out,
        simulator=simulator,
        work=wanted.work,
        seed=wanted.seed,
        seconds=QUICK_SECONDS if wanted.quick else SECONDS,
        explore=wanted.explore,
        settings={**({"quick": True} if wanted.quick else {}), **wanted.settings},
        methods=methods,
        clock=clock,
    )


def _split(recordings: Mapping[str, Recording], seed: int) -> tuple[dict[str, Parts], dict[str, str]]:
    """The parts of each recording, and why some have none. Raises TextureDataError where none has any."""
    parts: dict[str, Parts] = {}
    left_out: dict[str, str] = {}
    for name, each in recordings.items():
        try:
            parts[name] = split(each, seed=seed)
        except TextureDataError as refusal:
            left_out[name] = str(refusal)
    if not parts:
        raise TextureDataError("; ".join(left_out.values()))
    return parts, left_out


def judge(context: Context, wanted: Wanted, report: Report = lambda _line: None) -> Judged:
    """Fit, run free and time every method on every texture. Raises JobBroken for what fails other than by refusing."""
    start = context.clock()
    fits, plays = _fits(context, wanted), _plays(context, wanted)
    done, taken = finished(fits, plays, context, wanted, report)
    drives, why = _drives(context)
    return Judged(
        context, wanted,
        {job: done[job] for job in fits}, {job: done[job] for job in plays},
        drives,
        {name: ceiling(each) for name, each in drives.items()},
        {name: truth_of(each) for name, each in drives.items()},
        _steps(wanted, [done[job] for job in fits], report),
        _notes(context, why),
        context.clock() - start, len(done), taken,
    )  # fmt: skip


def finished(
    fits: Sequence[Fit], plays: Sequence[Play], context: Context, wanted: Wanted, report: Report
) -> tuple[dict[Job, Done], int]:
    """The results of these jobs, and of the explorations that they rest on; and how many were finished already."""
    waves: tuple[list[Job], list[Job]] = ([*_explores(context), *fits], [*plays])
    done = {job: found for wave in waves for job in wave if (found := load(job, context)) is not None}
    taken = len(done)
    for wave in waves:
        done |= _wave([job for job in wave if job not in done], context, wanted, report)
    return done, taken


def _wave(jobs: Sequence[Job], context: Context, wanted: Wanted, report: Report) -> dict[Job, Done]:
    from palpate.modeling.training.jobs import run_jobs

    if not jobs:
        return {}
    ordered = sorted(jobs, key=lambda job: not (isinstance(job, Fit) and job.method in SLOW))
    answers = run_jobs(
        partial(run, context=context), ordered, workers=wanted.workers, cluster=wanted.cluster, report=report
    )
    for each in answers:
        if each.card is not None and not each.card.is_file():
            raise TextureDataError(
                f"{each.job.name}: its worker wrote {each.card}, which is not here. The cluster's workers need the "
                "lab's folder under the same path."
            )
        if load(each.job, context) is None:
            keep(each, context)
        if isinstance(each.job, Fit):
            forget_checkpoints(each.job, context)
    return dict(zip(ordered, answers, strict=True))


def _explores(context: Context) -> list[Explore]:
    return [Explore(texture) for texture in context.recordings] if context.explore else []


def _fits(context: Context, wanted: Wanted) -> list[Fit]:
    whole = [Fit(texture, name) for texture in context.recordings for name in wanted.names]
    return whole + [
        Fit(texture, method, window, loss)
        for texture in context.recordings
        for method in wanted.grid
        for window in LENGTHS
        for loss in LOSSES
    ]


def _plays(context: Context, wanted: Wanted) -> list[Play]:
    """Every fit runs free; the generative network also by its mean alone, to show what that does."""
    return [play for fit in _fits(context, wanted) if not fit.of_the_grid for play in _ways(fit)]


def _ways(fit: Fit) -> Iterator[Play]:
    yield Play(fit)
    if fit.method == DEFAULT:
        yield Play(fit, sampled=False)


def _drives(context: Context) -> tuple[dict[str, Drive], dict[str, str]]:
    """What drives the models of each texture, and why nothing does."""
    found: dict[str, Drive] = {}
    why: dict[str, str] = {}
    for texture in context.recordings:
        try:
            found[texture] = drive_for(texture, context)
        except ValueError as refusal:
            why[texture] = str(refusal)
    return found, why


def _steps(wanted: Wanted, fits: Sequence[Done], report: Report) -> dict[str, Steps]:
    """The time of a step of each method by runtime, alone on the machine: its size is the same for all textures."""
    found: dict[str, Steps] = {}
    for done in fits:
        job = done.job
        if isinstance(job, Fit) and done.card is not None and job.method not in found:
            report(f"timing steps of {job.method}")
            try:
                found[job.method] = step_us(done.card, QUICK_STEPS if wanted.quick else STEPS, time.perf_counter_ns)
            except ValueError as refusal:
                report(f"{job.method}: no step was timed: {refusal}")
    return found


def _notes(context: Context, why: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    """What is to be known of each recording, and of its parts."""
    return {
        name: (*each.notes, *told(each, context.parts[name]), *((why[name],) if name in why else ()))
        for name, each in context.recordings.items()
    }

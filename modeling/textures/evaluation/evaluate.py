"""The evaluation of texture models: every method on every texture, one step ahead and in free runs; the default."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from palpate.modeling.evaluate.engine import EvaluateOptions, Results, evaluate
from palpate.modeling.evaluate.outputs import Choice
from palpate.modeling.textures.domain import (
    QUICK_SECONDS,
    SECONDS,
    Explore,
    Fit,
    Job,
    Play,
    TextureDomain,
    TextureResult,
    drive_for,
)
from palpate.modeling.textures.drive import Drive
from palpate.modeling.textures.free_run import ceiling, truth_of
from palpate.modeling.textures.methods import Method
from palpate.modeling.textures.recording import Parts, Recording, TextureDataError
from palpate.modeling.textures.registry import BASELINE, DEFAULT, METHODS, ON_REQUEST, demand_known
from palpate.modeling.textures.simulator import TextureSimulator
from palpate.modeling.textures.splitting import split, split_notes
from palpate.modeling.textures.windows import LENGTHS
from palpate.protocols.progress import Clock, Report, silent
from palpate.signals.textures.timing import step_us

Row = Mapping[str, Any]
RULE = (
    "The default is the method that keeps all limits of free running on the most textures; of equals, the one that ran "
    "on the most, and then the one with the least mean distance of felt levels."
)

NOWHERE = (math.inf, math.inf)
LOSSES = ("mae", "mse", "huber-1.2", "huber-1.6", "huber-2.0")
"""The losses of Figure 4.5, by their names in palpate.modeling.textures.foten_network."""
STEPS, QUICK_STEPS = 2000, 200
SLOW = ("dstn", "hapinf", "gan", "foten", "foten_thesis", "foten_generative", "ten", "ten_mfcc", "ten_wavelet")
"""Methods that take minutes to train; they start first, so that no core has a long one left at the end."""
Steps = Mapping[str, tuple[float, float, float]]


def choice(rows: Sequence[Row], textures: Sequence[Row]) -> Choice:
    """Return the default by `RULE`. `rows` are those of all methods, `textures` of each method on each texture.

    Without free runs it is the shipped default, since the error one step ahead says nothing about them.
    """
    ran = [row for row in rows if row.get("felt_dB") is not None]
    if not ran:
        why = (
            "Nothing could be run free, and the error one step ahead does not tell a living model from a dead one: "
            "the shipped default stays."
        )
        return Choice(DEFAULT, why)
    best = min(ran, key=lambda row: (-row["kept"], -row["ran"], row["felt_dB"]))
    within, of = int(best["kept"]), int(best["ran"])
    why = (
        f"No method keeps all limits of free running on any texture; {best['title']} has the least distance of felt "
        f"levels: {best['felt_dB']:.2f} dB."
        if not within
        else f"{best['title']} keeps all limits of free running on {within} of {of} textures, and its felt levels are "
        f"{best['felt_dB']:.2f} dB off."
    )
    sentences = _compare_default(ran, textures, best)
    if not any(row["method"] == DEFAULT for row in rows):
        sentences.append(f"The shipped default, {DEFAULT}, was not evaluated: palpate train keeps that default.")
    return Choice(best["method"], why, tuple(sentences))


def _compare_default(rows: Sequence[Row], textures: Sequence[Row], best: Row) -> list[str]:
    """Compare the generative network with the baseline, and with the best method if that is another."""
    ours = next((row for row in rows if row["method"] == DEFAULT), None)
    baseline = next((row for row in rows if row["method"] == BASELINE), None)
    sentences = []
    if ours is not None and baseline is not None:
        won, of = better(textures, DEFAULT, BASELINE)
        sentences.append(f"{ours['title']} is nearer to the truth than {baseline['title']} on {won} of {of} textures.")
    if ours is not None and best["method"] != DEFAULT:
        simple = "A baseline wins: " if best["method"] == BASELINE else ""
        sentences.append(
            f"{simple}{best['title']} beats {ours['title']}: limits met on {int(best['kept'])} against "
            f"{int(ours['kept'])} textures, felt levels {best['felt_dB']:.2f} against {ours['felt_dB']:.2f} dB off."
        )
    return sentences


def better(textures: Sequence[Row], one: str, other: str) -> tuple[int, int]:
    """Return the number of textures on which one method is better than another, and of those on which either ran.

    A method is better if it breaks fewer limits, or as many with a smaller error of felt levels. A method that did not
    run is worst.
    """
    by_texture: dict[str, dict[str, tuple[float, float]]] = {}
    for row in textures:
        if row["method"] in (one, other) and row.get("felt_dB") is not None:
            by_texture.setdefault(row["texture"], {})[row["method"]] = (len(row["beyond"].split()), row["felt_dB"])
    pairs = [[ranks.get(name, NOWHERE) for name in (one, other)] for ranks in by_texture.values()]
    return sum(ours < theirs for ours, theirs in pairs), len(pairs)


@dataclass(frozen=True, kw_only=True)
class TextureOptions(EvaluateOptions):
    """The options of an evaluation.

    `methods` None means all but `ON_REQUEST`. With `explore` the surfaces are simulated, and another exploration drives
    the models. `grid` names the methods whose windows and losses are compared too (Figure 4.5, Table 4.2). `work` is
    the folder of finished jobs. `settings` are passed to the methods.
    """

    work: Path
    methods: tuple[str, ...] | None = None
    explore: bool = False
    grid: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """The methods in the registry's order."""
        chosen = [name for name in METHODS if name not in ON_REQUEST] if self.methods is None else self.methods
        return tuple(name for name in METHODS if name in chosen)


@dataclass(frozen=True)
class TextureEvaluation:
    """All results: fits, free runs, the hands that drove them, and the time of a step by method and runtime."""

    domain: TextureDomain
    options: TextureOptions
    results: Results[Job]
    fits: Mapping[Fit, TextureResult]
    plays: Mapping[Play, TextureResult]
    drives: Mapping[str, Drive]
    ceilings: Mapping[str, Mapping[str, float | None]]
    truths: Mapping[str, Mapping[str, float | None]]
    steps: Mapping[str, Steps]
    notes: Mapping[str, tuple[str, ...]]
    seconds: float

    @property
    def textures(self) -> tuple[str, ...]:
        """The textures in the order of the recordings."""
        return tuple(self.domain.recordings)

    def method(self, name: str) -> Method:
        """Return one of the methods."""
        return self.domain.methods[name]


def domain_for(
    recordings: Sequence[Recording], simulator: TextureSimulator, options: TextureOptions,
    methods: Mapping[str, Method] = METHODS, clock: Clock = time.perf_counter,
) -> TextureDomain:  # fmt: skip
    """Return the domain of all jobs, without recordings that cannot be split.

    Raises TextureDataError for two recordings of one name, and where none can be split.
    """
    demand_known(options.methods or ())
    by_name = {recording.texture: recording for recording in recordings}
    if not recordings or len(by_name) < len(recordings):
        raise TextureDataError("recordings of different textures are expected: at least one, and one of each.")
    parts: dict[str, Parts] = {}
    left_out: dict[str, str] = {}
    for name, recording in by_name.items():
        try:
            parts[name] = split(recording, seed=options.seed)
        except TextureDataError as refusal:
            left_out[name] = str(refusal)
    if not parts:
        raise TextureDataError("; ".join(left_out.values()))
    return TextureDomain(
        recordings={name: by_name[name] for name in parts},
        parts=parts,
        left_out=left_out,
        simulator=simulator,
        work=options.work,
        seed=options.seed,
        seconds=QUICK_SECONDS if options.quick else SECONDS,
        explore=options.explore,
        settings={**({"quick": True} if options.quick else {}), **options.settings},
        methods=methods,
        clock=clock,
    )


def evaluate_methods(domain: TextureDomain, options: TextureOptions, report: Report = silent) -> TextureEvaluation:
    """Fit every method on every texture, run it freely, and time it.

    Raises JobBroken for a job that fails other than by a refusal.
    """
    start = domain.clock()
    whole = [Fit(texture, name) for texture in domain.recordings for name in options.names]
    fits = whole + [
        Fit(texture, method, window, loss)
        for texture in domain.recordings
        for method in options.grid
        for window in LENGTHS
        for loss in LOSSES
    ]
    plays = [
        play
        for fit in fits
        if not fit.of_the_grid
        for play in ([Play(fit), Play(fit, sampled=False)] if fit.method == DEFAULT else [Play(fit)])
    ]
    results = evaluate(domain, waves(domain, fits, plays), options, report)
    drives: dict[str, Drive] = {}
    notes = {name: [*recording.notes, *split_notes(recording, domain.parts[name])]
             for name, recording in domain.recordings.items()}  # fmt: skip
    for texture in domain.recordings:
        try:
            drives[texture] = drive_for(texture, domain)
        except ValueError as refusal:
            notes[texture].append(str(refusal))
    return TextureEvaluation(
        domain, options, results,
        {fit: results[fit] for fit in fits}, {play: results[play] for play in plays},
        drives,
        {name: ceiling(drive) for name, drive in drives.items()},
        {name: truth_of(drive) for name, drive in drives.items()},
        _time_steps(options, [results[fit] for fit in fits], report),
        {name: tuple(lines) for name, lines in notes.items()},
        domain.clock() - start,
    )  # fmt: skip


def waves(domain: TextureDomain, fits: Sequence[Fit], plays: Sequence[Play]) -> tuple[Sequence[Job], Sequence[Job]]:
    """Return two waves of jobs: fits, slow ones first, with explorations; and free runs, which build on both."""
    explorations = [Explore(texture) for texture in domain.recordings] if domain.explore else []
    slow = [fit for fit in fits if fit.method in SLOW]
    return [*slow, *explorations, *(fit for fit in fits if fit.method not in SLOW)], plays


def _time_steps(options: TextureOptions, fits: Sequence[TextureResult], report: Report) -> dict[str, Steps]:
    """Time a step of each method by runtime, on its first texture, since networks have the same size on all."""
    steps: dict[str, Steps] = {}
    for result in fits:
        job = result.job
        if isinstance(job, Fit) and result.files and job.method not in steps:
            report(f"timing steps of {job.method}")
            try:
                count = QUICK_STEPS if options.quick else STEPS
                steps[job.method] = step_us(result.files[0], count, time.perf_counter_ns)
            except ValueError as refusal:
                report(f"{job.method}: no step was timed: {refusal}")
    return steps

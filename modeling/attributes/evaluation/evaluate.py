"""The evaluation of all methods on the same folds, leaving each texture out once, and the choice of the default."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.attributes.domain import AttributeDomain, LeaveOut, textures_named
from palpate.modeling.attributes.entries import FEELING, MAIN, ON_REQUEST, PROPOSED, SEEING, Entry, Own, entries
from palpate.modeling.attributes.folds import LEAST, leave_one_texture_out, sample_textures
from palpate.modeling.attributes.joining import has_rows, modalities_of, reasons_of
from palpate.modeling.attributes.material import Material, MaterialError, parts_of, ratings_of, save_material
from palpate.modeling.attributes.methods import Method
from palpate.modeling.evaluate.engine import EvaluateOptions, Result, Results, evaluate
from palpate.modeling.evaluate.outputs import Choice
from palpate.protocols.progress import Clock, Report, silent
from palpate.signals.arrays import Array

Row = Mapping[str, Any]
DEFAULT = PROPOSED
"""The method to train where no evaluation of the same textures chose another one."""
RULE = (
    "The default is the method with the least MAE, mean over textures and attributes, of those that answered for every "
    "texture; of equals, the one that is trained faster."
)
QUICK_TEXTURES = 5


def choice(rows: Sequence[Row]) -> Choice:
    """Return the default by `RULE`, from the rows of all methods (`mae`, `train_s`, and against the best `best_*`).

    It is the shipped default where no method answered for every texture.
    """
    answered = [row for row in rows if row["mae"] is not None]
    if not answered:
        return Choice(DEFAULT, "No method answered for every texture: the shipped default stays.")
    best = min(answered, key=lambda row: (row["mae"], row["train_s"]))
    return Choice(
        best["method"], f"{best['title']} has the least MAE: {best['mae']:.2f} (0 to 100).", _ours(best, answered)
    )


def _ours(best: Row, rows: Sequence[Row]) -> tuple[str, ...]:
    """Return sentences that compare the thesis' network with the other methods."""
    ours = next((row for row in rows if row["method"] == PROPOSED), None)
    if ours is None:
        return ("The thesis' network was not evaluated, or did not answer for every texture.",)
    if best["method"] != PROPOSED:
        chance = ", which may be chance" if ours["best_chance"] else ""
        more = f"{ours['mae'] - best['mae']:.2f} more than that of {best['title']}{chance}"
        return (f"The MAE of the thesis' network is not the lowest: {ours['mae']:.2f}, {more}.",)
    if len(rows) == 1:
        return ("Nothing else was evaluated.",)
    close = [row["title"] for row in rows if row["method"] != PROPOSED and row["best_chance"]]
    lead = f"Its lead over {', '.join(close)} may be chance." if close else "No interval of its leads holds 0."
    return ("The MAE of the thesis' network is the lowest.", lead)


def fusion(rows: Sequence[Row]) -> tuple[str, str] | None:
    """Return a label and a sentence that compare the errors of the proposed network and of each of its branches.

    None where they were not all evaluated. The rows' `ours_*` are the differences from the proposed network.
    """
    answered = {row["method"]: row for row in rows if row["mae"] is not None}
    if not {PROPOSED, SEEING, FEELING} <= set(answered):
        return None
    ours = answered[PROPOSED]["mae"]
    branches = [answered[name] for name in (SEEING, FEELING)]
    parts = []
    for row in branches:
        chance = " (a difference that may be chance)" if row["ours_chance"] else ""
        parts.append(f"{row['title']} {row['mae']:.2f}{chance}")
    is_reached = all(ours < row["mae"] for row in branches)
    sentence = f"Both senses {ours:.2f}, {' and '.join(parts)} (MAE; aim: less than each branch by itself)"
    return "Fusion", f"{sentence}: {'reached' if is_reached else 'not reached'}."


@dataclass(frozen=True, kw_only=True)
class AttributeOptions(EvaluateOptions):
    """Options of an evaluation.

    `work` is the folder of finished jobs and of the stored textures. `methods`: None for all but `ON_REQUEST`.
    `ablations`: also Tables 3.4 and 3.5. `quick`: five textures are left out, and few epochs are trained. `epochs`:
    None for each method's own. `folds`: the number of textures to leave out, in turn from each class (None: all);
    `quick` overrides it. `early_stopping`: the thesis' network and its branches watch held textures, as the baselines
    do.
    """

    work: Path
    methods: tuple[str, ...] | None = None
    ablations: bool = True
    epochs: int | None = None
    folds: int | None = None
    early_stopping: bool = False

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of the methods: one thread for each job, and the caller's options."""
        settings = {"quick": self.quick or None, "epochs": self.epochs, "early_stopping": self.early_stopping or None}
        return {"threads": 1, **{name: value for name, value in settings.items() if value is not None}}


@dataclass(frozen=True)
class AttributeEvaluation:
    """The results of all entries on all textures that were left out.

    `times` are the seconds of one texture's features, by kind, where they were measured; `left_out` are the textures
    that were not used, with the reasons.
    """

    material: Material
    domain: AttributeDomain
    options: AttributeOptions
    entries: tuple[Entry, ...]
    results: Results[LeaveOut]
    seconds: float
    times: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def watching(self) -> bool:
        """Whether one of the methods watches held textures to stop early."""
        return any(self.method(entry).holds(self.options.settings) for entry in self.entries)

    @property
    def tested(self) -> tuple[str, ...]:
        """The ids of the tested textures, in the material's order."""
        return tuple(self.domain.folds)

    def method(self, entry: Entry) -> Method:
        """Return an entry's method."""
        return self.domain.methods[entry.method]

    def of(self, table: str) -> tuple[Entry, ...]:
        """Return the entries of a table."""
        return tuple(entry for entry in self.entries if table in entry.tables)

    def main(self, method: str) -> Entry | None:
        """Return the entry of a method with its own features; None where it was not evaluated."""
        return next((entry for entry in self.of(MAIN) if entry.method == method), None)

    def results_of(self, entry: Entry) -> list[Result[LeaveOut]]:
        """Return an entry's results, in the order of `tested`."""
        return [self.results[LeaveOut(entry, test)] for test in self.tested]

    def refused(self, entry: Entry) -> str:
        """Return why an entry was refused for at least one texture; "" where it was not."""
        return next((result.refused for result in self.results_of(entry) if result.refused), "")

    def predicted(self, entry: Entry) -> Array:
        """Return the predictions (tested, attributes) on 0..100 of an entry that was not refused."""
        return np.stack([result.predicted for result in self.results_of(entry)])

    def rated(self) -> Array:
        """Return the mean ratings (tested, attributes) on 0..100."""
        return ratings_of(textures_named(self.material, self.tested))

    def unused(self) -> list[str]:
        """Return the textures that were not used, by reason: "T02, T05: it was not rated"."""
        return by_reason(self.left_out)

    def groups(self) -> tuple[int, ...]:
        """Return a group number for each tested texture; textures that share content have the same number."""
        first = [min(fold.test, *fold.apart) if fold.apart else fold.test for fold in self.domain.folds.values()]
        return tuple(sorted(set(first)).index(name) for name in first)


def usable(material: Material) -> tuple[Material, dict[str, str]]:
    """Return the textures that all methods can be compared on, and the reasons for leaving out the others.

    Usable textures are rated, and have recordings, and pictures, if any texture has. Raises MaterialError where nothing
    was rated, and where too few textures remain, with the reasons.
    """
    rated = material.rated()
    has_touch, has_sight = modalities_of(rated.textures)
    left_out = {texture.id: "it was not rated" for texture in material.textures if texture.rated is None}
    for texture in rated.textures:
        parts = (("recording", has_touch, texture.touch), ("picture", has_sight, texture.sight))
        missing = [what for what, needed, own in parts if needed and not has_rows(own)]
        if missing:
            why = [note for what in missing for note in reasons_of(texture, what)]
            why_not = f"no {' and no '.join(missing)} of it can be used"
            left_out[texture.id] = f"{why_not} ({'; '.join(why)})" if why else why_not
    used = tuple(texture for texture in rated.textures if texture.id not in left_out)
    if len(used) < LEAST <= len(material.textures):
        raise MaterialError(
            f"{len(used)} of {len(material.textures)} textures have all that the others have, {LEAST} at least are"
            f" needed. {'; '.join(by_reason(left_out))}. Record, photograph and rate the same textures."
        )
    return replace(rated, textures=used), left_out


def by_reason(left_out: Mapping[str, str]) -> list[str]:
    """Return a line for each reason, with the textures that were left out for it."""
    names: dict[str, list[str]] = {}
    for name, why in left_out.items():
        names.setdefault(why, []).append(name)
    return [f"{', '.join(textures)}: {why}" for why, textures in names.items()]


def domain_for(
    material: Material, options: AttributeOptions, methods: Mapping[str, Method], clock: Clock = time.perf_counter
) -> AttributeDomain:
    """Return the domain of all jobs, and store its textures. Raises MaterialError for too few usable textures."""
    rated, _ = usable(material)
    count = QUICK_TEXTURES if options.quick else options.folds
    classes = {texture.id: texture.category for texture in rated.textures}
    only = None if count is None else sample_textures(classes, count, options.seed)
    folds = leave_one_texture_out(rated, options.seed, only=only)
    return AttributeDomain(
        work=options.work,
        digest=save_material(rated, options.work),
        parts=parts_of(rated),
        attributes=rated.attributes,
        folds={fold.test: fold for fold in folds},
        methods=methods,
        seed=options.seed,
        settings=options.settings,
        clock=clock,
    )


def require_methods(names: Sequence[str], methods: Mapping[str, Method]) -> None:
    """Raise MaterialError for the name of an unknown method."""
    unknown = [name for name in names if name not in methods]
    if unknown:
        from palpate.protocols.did_you_mean import nearest

        raise MaterialError(f"no method {unknown[0]!r}; {nearest(unknown[0], methods)}")


def evaluate_methods(
    material: Material, options: AttributeOptions, methods: Mapping[str, Method], own: Own, report: Report = silent,
    times: Mapping[str, float] | None = None, clock: Clock = time.perf_counter,
) -> AttributeEvaluation:  # fmt: skip
    """Fit every entry without each tested texture, and predict that texture; return all results.

    Raises MaterialError for an unknown method or too few textures, JobBroken for a job that fails by another error.
    """
    require_methods(options.methods or (), methods)
    start = clock()
    domain = domain_for(material, options, methods, clock)
    chosen = [name for name in methods if name not in ON_REQUEST] if options.methods is None else options.methods
    names = tuple(name for name in methods if name in chosen)
    every = entries(names, methods, own, options.ablations)
    jobs = [LeaveOut(entry, test) for entry in every for test in domain.folds]
    slow_first = sorted(jobs, key=lambda job: not methods[job.entry.method].in_epochs)
    results = evaluate(domain, [slow_first], options, report)
    used, left_out = usable(material)
    return AttributeEvaluation(used, domain, options, every, results, clock() - start, times or {}, left_out)

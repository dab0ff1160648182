"""The answers about psychometric functions of collected choices: each track's own design, JND and Weber fraction."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from palpate.analysis.choices.evidence import (
    RATIO,
    SURE,
    LevelsPosterior,
    levels_posterior,
    no_threshold,
    outside_of,
)
from palpate.analysis.choices.psychometric import Psychometric, fit_function
from palpate.analysis.choices.specification import WICHMANN_HILL, FunctionSpec, Levels, gather_levels
from palpate.analysis.plans.answers import Answer, plain_row, require_columns
from palpate.analysis.plans.families.choices import PsychometricFunction
from palpate.analysis.plans.families.declared_answers import (
    LEVELS,
    declared_model,
    declared_numbers,
    lapse_notes,
    threshold_share,
    track_posterior,
)
from palpate.analysis.plans.families.function_summaries import (
    HOW,
    PARTICIPANT,
    difference_rows,
    fitted_numbers,
    summary_rows,
)
from palpate.analysis.plans.families.rows import parts_of
from palpate.analysis.plans.families.spaces_answers import rows_of, sentences
from palpate.analysis.ratings.collected_choices import GUESS_KNOWN, TrackDesign, track_design
from palpate.analysis.ratings.dataset import DataRefused, DeclarationRefused
from palpate.analysis.statistics.refusals import NoEstimate, StatisticsError
from palpate.protocols.tracks import EASY, NO_CATCH

if TYPE_CHECKING:
    from palpate.analysis.choices.declared_model import DeclaredModel, ModelPosterior
    from palpate.analysis.plans.answers import Row, Selected

BY = (PARTICIPANT, "track")
NUMBERS = (
    "trials", "threshold", "threshold_low", "threshold_high", "threshold_sd", "outside", "bound", "sure", "jnd",
    "jnd_low", "jnd_high", "standard", "weber", "weber_low", "weber_high", "slope", "guess", "lapse", "threshold_at",
    "prior", "likelihood_ratio", "deviance", "df", "p_deviance",
)  # fmt: skip
POINTS = 61
SUMMED = ("threshold", "jnd", "weber")


def collected_answer(selected: Selected, settings: PsychometricFunction) -> Answer:
    """Return one row for each combination of `by`; a function without an estimate has a row with the reason."""
    by = BY if settings.by is None else settings.by
    table = selected.table
    require_columns(table, by)
    rows: list[dict[str, Any]] = []
    levels: list[pd.DataFrame] = []
    curves: list[Row] = []
    densities: list[Row] = []
    models: dict[str, list[str]] = {}
    for where, part in parts_of(table, by):
        function = CollectedFunction(selected, settings, part)
        row, shown = function.row()
        rows.append({**where, **row})
        levels += [] if shown is None else [shown.assign(**where)]
        for rows_so_far, own in ((curves, function.curve()), (densities, function.density())):
            rows_so_far += [{**where, **point} for point in own]
        for declared in function.declared_models():
            models.setdefault(declared.describe(), []).append(where.get("track", ""))
    if all(row["threshold"] is None and row["outside"] is None for row in rows):
        raise StatisticsError(f"no threshold could be estimated: {rows[0]['note']}")
    joined = pd.concat(levels, ignore_index=True)
    more: dict[str, tuple[Row, ...]] = {
        "summary": tuple(summary_rows(rows, by, SUMMED, settings.confidence)),
        "differences": tuple(difference_rows(rows, by, SUMMED[:2], settings.confidence)),
        "levels": rows_of(joined[[*by, *(column for column in joined if column not in by)]]),
        "curve": tuple(curves),
        "posterior": tuple(densities),
        "trials": tuple(_trial_rows(table, by)),
    }
    more = {name: table for name, table in more.items() if table or name != "differences"}
    return _answer(selected, settings, rows, by, more, models)


def spec_of(settings: PsychometricFunction, design: TrackDesign) -> FunctionSpec:
    """Return the function of a design. Raises DeclarationRefused for a guess rate where the design decides it.

    Adaptive tracks hardly visit the levels that tell of lapses: a plan that names no rate has Wichmann & Hill's.
    """
    guess: float | tuple[float, float] | None = design.guess
    if "guess" in settings.model_fields_set:
        if design.task != "yes_no":
            raise DeclarationRefused(GUESS_KNOWN)
        guess = settings.guess
    of_design = {
        "task": design.task, "alternatives": design.alternatives, "correct": design.hits, "falling": design.falling,
    }  # fmt: skip
    lapse = WICHMANN_HILL if settings.lapse is None and design.is_adaptive else settings.lapse
    interval = settings.interval or "corrected"
    own = settings.model_copy(update={**of_design, "guess": guess, "lapse": lapse, "interval": interval})
    own = own.model_copy(update={"interval": "corrected"}) if own.interval == "posterior" else own
    return replace(own.model(), standard=design.nothing_at)


@dataclass
class CollectedFunction:
    """The choices of one function. Each part that several results need is computed once, when it is first needed."""

    selected: Selected
    settings: PsychometricFunction
    part: pd.DataFrame

    @cached_property
    def _designed(self) -> tuple[TrackDesign, pd.DataFrame]:
        return track_design(self.part, self.settings.easy_catch == "counted", self.selected.tracks)

    @property
    def design(self) -> TrackDesign:
        """The function of these choices. Raises DataRefused."""
        return self._designed[0]

    @property
    def used(self) -> pd.DataFrame:
        """The choices that the function is fitted to. Raises DataRefused."""
        return self._designed[1]

    @cached_property
    def with_easy(self) -> pd.DataFrame:
        """These with the catch trials at the easiest level, which are looked at for lapses in any case."""
        if self.settings.easy_catch == "counted" or not (self.part["catch"].astype(str) == EASY).any():
            return self.used
        return track_design(self.part, True, self.selected.tracks)[1]

    @cached_property
    def spec(self) -> FunctionSpec:
        """The function's specification. Raises DeclarationRefused for a guess rate that the design decides."""
        return spec_of(self.settings, self.design)

    @cached_property
    def given(self) -> Levels:
        """The counted levels. Raises StatisticsError."""
        return gather_levels(self.used, "level", self.design.hits)

    @cached_property
    def declared(self) -> DeclaredModel | None:
        """The model that the study declares, if it decides the posterior. Raises DataRefused."""
        return declared_model(self.selected, self.settings, self.design, self.used)

    @cached_property
    def model_posterior(self) -> ModelPosterior | None:
        """The posterior under the declared model, if there is one. Raises NoEstimate."""
        return None if self.declared is None else track_posterior(self.declared, self.used)

    @cached_property
    def posterior(self) -> LevelsPosterior:
        """The posterior whose prior follows from the levels."""
        return levels_posterior(self.given, self.spec)

    def row(self) -> tuple[dict[str, Any], pd.DataFrame | None]:
        """Return a row about the function and the shares at its levels (None if there is no design or one level)."""
        row: dict[str, Any] = {"design": None, "procedure": None, **dict.fromkeys(NUMBERS), "note": ""}
        notes: list[str] = []
        shown = None
        try:
            design, used, _ = self.design, self.used, self.with_easy
            row |= {"design": str(used["design"].iloc[0]), "procedure": design.procedure, "standard": design.standard}
            spec = self.spec
            row["trials"] = len(used)
            shown = _shares(self.given)
            if self.model_posterior is None:
                numbers, more, fit = self._estimate(spec)
                shown = shown if fit is None else fit.table
            else:
                numbers, more = declared_numbers(self.settings, self.model_posterior, self.with_easy)
            row |= numbers
            notes += more
            if row["threshold"] is not None:
                row |= weber(row, design, self.settings.level_unit == "db")
            for count, what in (
                (design.catch, "catch trial(s) left out"),
                (design.silent, "trial(s) without a signal left out"),
                (design.easy, "catch trial(s) at the easiest level counted"),
            ):
                notes += [f"{count} {what}"] if count else []
        except StatisticsError as refusal:
            notes.append(str(refusal))
        except DeclarationRefused:
            raise
        except DataRefused as refusal:
            notes.append(str(refusal))
        return {**row, "note": "; ".join(note for note in notes if note)}, shown

    def _estimate(self, spec: FunctionSpec) -> tuple[dict[str, Any], list[str], Psychometric | None]:
        """Return the numbers, notes, and the fit by maximum likelihood if the estimates are from it."""
        settings, design, given = self.settings, self.design, self.given
        evidence = self.posterior.evidence(settings.confidence)
        numbers: dict[str, Any] = {"likelihood_ratio": math.exp(min(evidence.ratio, 690.0))}
        side, bound = outside_of(evidence, given, spec)
        guesses, notes = evidence.ratio < math.log(RATIO), []
        if not guesses:
            easy = self.posterior
            if self.with_easy is not self.used:
                easy = levels_posterior(gather_levels(self.with_easy, "level", design.hits), spec)
            notes += lapse_notes(easy.lapse_excess(), spec.lapse[1], "allow more with `lapse: [0, 0.3]`")
        if side:
            if bound is not None:
                notes.insert(0, f"the threshold is {side} {bound:.4g}, {SURE:.0%} sure")
            if guesses and not _all_alike(given):
                notes.insert(0, no_threshold(given, spec, evidence.ratio))
            known = {"outside": side, "bound": bound, "sure": None if bound is None else SURE}
            return numbers | known, notes, None
        interval = settings.interval or ("posterior" if design.is_adaptive else "corrected")
        if interval != "posterior":
            try:
                fit = fit_function(given, spec)
                own, more, _ = fitted_numbers(self.selected, settings, fit, interval)
                return numbers | own | {"threshold_at": fit.at}, [*notes, *fit.notes, *more], fit
            except NoEstimate as refusal:
                if settings.interval is not None:
                    raise
                why = str(refusal).split(":", maxsplit=1)[0]
                notes.append(f"{why}: estimates are from the posterior, whose prior bounds the slope")
        elif design.is_adaptive and settings.interval is None:
            notes.append(
                "levels that follow from the answers hardly determine a slope: the posterior's prior bounds it"
            )
        return numbers | {
            "threshold": evidence.threshold,
            "threshold_low": evidence.threshold_interval[0],
            "threshold_high": evidence.threshold_interval[1],
            "threshold_sd": evidence.sd,
            "threshold_at": settings.threshold,
            "prior": LEVELS,
            "jnd": evidence.jnd,
            "jnd_low": evidence.jnd_interval[0],
            "jnd_high": evidence.jnd_interval[1],
            "guess": evidence.guess,
            "lapse": evidence.lapse,
        }, notes, None  # fmt: skip

    def declared_models(self) -> Iterator[DeclaredModel]:
        """Yield the declared model of these choices, if it decides them."""
        try:
            model = self.declared
        except DataRefused:
            return
        if model is not None:
            yield model

    def density(self) -> list[Row]:
        """Return points of the posterior and prior density of the threshold, per unit of the level, for drawing."""
        try:
            if self.model_posterior is None:
                density = self.posterior.density()
            else:
                density = self.model_posterior.density(threshold_share(self.settings, self.declared))
        except (StatisticsError, DataRefused):
            return []
        rows = zip(*(part.tolist() for part in density), strict=True)
        return [{"level": x, "density": y, "prior_density": z} for x, y, z in rows]

    def curve(self) -> list[Row]:
        """Return points of the function for drawing: the expected share, and its pointwise interval."""
        try:
            spec, given = self.spec, self.given
            low, high = float(given.levels[0]), float(given.levels[-1])
            room = 0.04 * (high - low)
            at = np.linspace(low if spec.shape.logarithmic else low - room, high + room, POINTS)
            curve = (self.posterior if self.model_posterior is None else self.model_posterior).curve(
                at, self.settings.confidence
            )
        except (StatisticsError, DataRefused):
            return []
        rows = zip(at.tolist(), *(part.tolist() for part in curve), strict=True)
        return [{"level": x, "share": y, "low": a, "high": b} for x, y, a, b in rows]


def function_row(
    selected: Selected, settings: PsychometricFunction, part: pd.DataFrame
) -> tuple[dict[str, Any], pd.DataFrame | None]:
    """Return a row about one function and the shares at its levels (None if there is no design or one level)."""
    return CollectedFunction(selected, settings, part).row()


def _all_alike(given: Levels) -> bool:
    return float(given.hits.sum()) in (0.0, float(given.trials.sum()))


def weber(row: dict[str, Any], design: TrackDesign, in_db: bool) -> dict[str, Any]:
    """Return JND and Weber fraction of a row with a threshold.

    In a forced choice against a standard the JND is the distance of the threshold from the standard. The Weber fraction
    is JND / standard, of levels in dB the ratio 10^(JND / 20) - 1; there is none without a standard.
    """
    result: dict[str, Any] = {}
    if design.standard is None:
        return result
    names = ("jnd", "jnd_low", "jnd_high")
    if design.task == "forced_choice":
        ends = [row["threshold"], row["threshold_low"], row["threshold_high"]]
        sizes = [
            None if end is None else max((end - design.standard) * (-1 if design.falling else 1), 0) for end in ends
        ]
        if design.falling:
            sizes = [sizes[0], sizes[2], sizes[1]]
        result |= dict(zip(names, sizes, strict=True))
    for name, own in zip(names, ("weber", "weber_low", "weber_high"), strict=True):
        size = result.get(name, row[name])
        if size is None or (not in_db and design.standard == 0):
            continue
        result[own] = 10 ** (size / 20) - 1 if in_db else size / abs(design.standard)
    return result


def _shares(given: Levels) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "level": given.levels, "n": given.trials.astype(int), "hits": given.hits.astype(int),
            "share": given.hits / given.trials, "expected": np.nan, "deviance_residual": np.nan,
        }
    )  # fmt: skip


def _trial_rows(table: pd.DataFrame, by: tuple[str, ...]) -> Iterator[Row]:
    """Yield the levels and answers of every trial with a level, in order: what a figure of a track is drawn from."""
    for where, part in parts_of(table, by):
        shown = part[(part["catch"].astype(str) == NO_CATCH) & part["level"].notna()]
        for n, (level, hit, correct) in enumerate(
            shown[["level", "hit", "correct"]].itertuples(index=False, name=None), start=1
        ):
            right = hit if pd.isna(correct) else correct
            yield {**where, "n": n, "level": float(level), "correct": None if pd.isna(right) else bool(right)}


def _answer(
    selected: Selected,
    settings: PsychometricFunction,
    rows: list[dict[str, Any]],
    by: tuple[str, ...],
    more: dict[str, tuple[Row, ...]],
    models: dict[str, list[str]],
) -> Answer:
    missing = [row for row in rows if row["threshold"] is None]
    jnd = "(x.75 - x.25) / 2 of F" if settings.jnd == "half_interquartile" else "x.84 - x.50 of F"
    how = HOW[settings.interval] if settings.interval else (
        "of constant levels profile likelihood with Bartlett's correction, of staircases and QUEST+ the posterior"
    )  # fmt: skip
    declared = "".join(
        f". Of {', '.join(sorted(set(filter(None, names)))) or 'QUEST+ tracks'} by the model that the study declares: "
        f"{model}"
        for model, names in models.items()
    )
    at = sorted({float(row["threshold_at"]) for row in rows if row["threshold_at"] is not None})
    where_f = " or ".join(f"{share:.3g}" for share in at) or f"{settings.threshold:g}"
    parts = []
    for row in more["summary"]:
        where = ", ".join(f"{name} {row[name]}" for name in by if name != PARTICIPANT)
        name = {"jnd": "JND", "weber": "Weber fraction"}.get(str(row["quantity"]), str(row["quantity"]))
        of = int(row["n"] or 0) + int(row["without_estimate"] or 0)
        parts.append(f"{where and where + ': '}{name} {row['mean']:.3g} (n = {row['n']} of {of})")
    return Answer(
        rows=tuple(plain_row(row) for row in rows),
        method=f"Psychometric functions ({settings.function}) of collected choices, task and guess rate by their "
        f"design; threshold where F = {where_f}; {100 * settings.confidence:g}% intervals: {how}. There "
        "is a threshold where the likelihood ratio against a flat function, averaged over a prior, is 20 or more "
        f"(Ville 1939){declared}",
        kinds={
            "threshold": f"level where F = {where_f}",
            "threshold_at": "F at the threshold",
            "prior": "prior of the posterior: the study's declared model, or one by the levels presented",
            "outside": "where the threshold is, if not within the levels",
            "bound": "the threshold is beyond it with the probability `sure`",
            "jnd": f"{jnd}; in a forced choice against a standard the distance of the threshold from it",
            "weber": "10^(JND / 20) - 1" if settings.level_unit == "db" else "JND / standard",
            "likelihood_ratio": "against a flat function, averaged over the prior",
            "slope": "slope of the function at the threshold, per unit of level",
            "p_deviance": "p of the deviance, Monte Carlo",
            "difference": "mean over participants of one minus two",
            "p": "two-sided p of a paired t test, not corrected",
            "p_corrected": "p, corrected by Holm's method over the pairs of a quantity",
        },
        participants=int(selected.table[PARTICIPANT].nunique()),
        values=sum(row["trials"] or 0 for row in rows),
        headline=f"Mean {'; '.join(parts[:6])}" if parts else "No threshold is within the levels",
        notes=sentences(
            [
                f"{len(missing)} of {len(rows)} functions have no number (see `note`)" if missing else "",
                "thresholds are at different values of F (`threshold_at`) and cannot be compared; give `threshold`"
                if len(at) > 1
                else "",
            ]
        ),
        more=more,
    )

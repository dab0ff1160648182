"""Reasons, known from a study's declaration alone, why its choices cannot answer a test."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

from palpate.analysis.plans.study_tables import trial_row
from palpate.analysis.plans.where import keeps
from palpate.analysis.ratings.collected_choices import (
    GUESS_KNOWN,
    GUESSING,
    NO_LEVELS,
    NO_RIGHT_ANSWER,
    NO_SCALE,
    TABLE,
    TWO_DIMENSIONS,
    common_tracks,
    no_model_in_common,
    several_values,
    study_tracks,
)
from palpate.protocols.complaints import Problem
from palpate.protocols.forms import own_tables
from palpate.protocols.wording import count

if TYPE_CHECKING:
    from palpate.analysis.plans.families.choices import BinomialMixedModel, ChoiceSettings, PsychometricFunction
    from palpate.analysis.plans.study_factors import StudyFactors
    from palpate.protocols.study import Study
    from palpate.protocols.tracks import Track

TEST = ("test",)
"""The key of a plan that these problems are at."""


def scale_problems(_settings: ChoiceSettings, design: StudyFactors, _: Collection[str]) -> Iterator[Problem]:
    """Yield why stimuli cannot be scaled by the study's choices."""
    study = design.study
    if study.pairs is None:
        yield Problem(TEST, f"{NO_SCALE}this study has a `procedure`, not `pairs`")
    elif study.intervals.design != "forced_choice":
        yield Problem(TEST, f"{NO_SCALE}`intervals` have the design {study.intervals.design}")


def sensitivity_problems(_settings: ChoiceSettings, design: StudyFactors, _: Collection[str]) -> Iterator[Problem]:
    """Yield why the study's choices have no d'."""
    if design.study.pairs is not None and design.study.intervals.design == "forced_choice":
        yield Problem(TEST, NO_RIGHT_ANSWER)


def function_problems(settings: PsychometricFunction, design: StudyFactors, _: Collection[str]) -> Iterator[Problem]:
    """Yield why the study's choices have no psychometric function."""
    if why := _why_no_function(settings, design.study):
        yield Problem(TEST, why)


def mixed_model_problems(settings: BinomialMixedModel, design: StudyFactors, _: Collection[str]) -> Iterator[Problem]:
    """Yield why the study's choices have no binomial mixed model."""
    if why := _why_no_mixed_model(settings, design.study):
        yield Problem(TEST, why)


def _why_no_function(settings: PsychometricFunction, study: Study) -> str:
    """Return why the study's choices have no psychometric function, "" if they have one."""
    if study.pairs is not None:
        return NO_LEVELS
    if "guess" in settings.model_fields_set and study.intervals.design not in ("yes_no", "same_different"):
        return GUESS_KNOWN
    by = ("participant", "track") if settings.by is None else settings.by
    asks_model = settings.prior == "declared_model" and settings.interval in (None, "posterior")
    whys = [_why_not_together(tracks, study, asks_model) for tracks in _tracks_together(settings, by, study)]
    return whys[0] if whys and all(whys) else ""


def _why_no_mixed_model(settings: BinomialMixedModel, study: Study) -> str:
    """Return why the study's choices have no binomial mixed model, "" if they have one."""
    if study.pairs is not None:
        return NO_LEVELS
    intervals = study.intervals
    if intervals.chance is not None:
        return f"the study's design is {intervals.design}: {GUESSING}"
    by = () if settings.condition is None else (settings.condition,)
    if settings.random == "intercept_and_condition" and (why := _why_no_two_conditions(settings, study)):
        return why
    parts = _tracks_together(settings, by, study)
    return next(filter(None, (_why_not_together(tracks, study, False) for tracks in parts)), "")


def _why_no_two_conditions(settings: BinomialMixedModel, study: Study) -> str:
    """Return why participants cannot differ in the difference of two conditions, "" if they can."""
    name = str(settings.condition)
    met: dict[str, set[str]] = {}
    for row in _rows_kept(settings, study):
        met.setdefault(row.columns["group"], set()).add(row.columns.get(name, ""))
    if not met:
        return ""  # `where` leaves nothing, as the answers will show
    levels = set().union(*met.values())
    if len(levels) == 2 and any(len(own) == 2 for own in met.values()):
        return ""
    if levels == {""}:
        what = "is known from answers only"
    else:
        what = "differs by group" if len(levels) == 2 else f"has {count(len(levels), 'level')} here"
    return f"`random: intercept_and_condition` is for two conditions that a participant meets; {name!r} {what}"


class _Row(NamedTuple):
    """A track that somebody of a group has, with what its rows in the table hold in the columns known before."""

    track: Track
    columns: dict[str, str]


def _tracks_together(settings: ChoiceSettings, by: Sequence[str], study: Study) -> Iterator[list[Track]]:
    """Yield the tracks whose choices are taken together; nothing where columns decide that only answers fill."""
    kept = _rows_kept(settings, study)
    known = kept[0].columns if kept else {}
    of_answers = {*(column.name for column in own_tables()[TABLE].columns), "trial", "seq", "attempt"} - set(known)
    if of_answers & {*by, *settings.where}:
        return
    group = ("group",) if "participant" in by else ()
    together: dict[tuple[str, ...], dict[str, Track]] = {}
    for row in kept:
        key = tuple(row.columns[name] for name in (*by, *group) if name in known)
        together.setdefault(key, {})[row.track.name] = row.track
    yield from (list(tracks.values()) for tracks in together.values())


def _rows_kept(settings: ChoiceSettings, study: Study) -> list[_Row]:
    """Return the rows that `where` keeps, as far as their columns are known before."""
    return [
        row
        for row in _rows(study)
        if all(keeps(condition, row.columns[name]) for name, condition in settings.where.items() if name in row.columns)
    ]


def _rows(study: Study) -> Iterator[_Row]:
    for group in study.groups or (None,):
        for track in study_tracks(study, group).values():
            own = {"track": track.name, "procedure": track.procedure.kind, "design": study.intervals.design}
            for stimulus, session in product(track.stimuli, range(1, study.sessions + 1)):
                row = trial_row(study, group, stimulus, session) | own
                if study.declares_sessions:
                    row["session_number"] = row["session"]
                else:
                    del row["session"]
                yield _Row(track, row)


def _why_not_together(tracks: Sequence[Track], study: Study, asks_model: bool) -> str:
    """Return why the choices of these tracks have no function in common, "" if they have one.

    `asks_model`: the plan asks for the model that QUEST+ tracks declare.
    """
    for name, values in (
        ("procedure", {track.procedure.kind: None for track in tracks}),
        ("standard", {track.standard_level: None for track in tracks if track.standard_level is not None}),
    ):
        if len(values) > 1:
            return several_values(name, list(values))
    if any(len(track.procedure.grids) > 1 for track in tracks):
        return TWO_DIMENSIONS
    if asks_model and tracks[0].procedure.kind == "questplus":
        common = common_tracks(study)
        models = [
            (track.procedure.model, track.levels, track.procedure.easier)  # type: ignore[attr-defined]
            for track in tracks
            if track.name in common
        ]
        if len(models) < len(tracks) or any(model != models[0] for model in models):
            return no_model_in_common(sorted(track.name for track in tracks))
    return ""

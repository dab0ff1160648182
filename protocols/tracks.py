"""Tracks: runs of trials with one procedure over a declared grid of levels, interleaved before the session begins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

from palpate.protocols.keyed import Key, shuffled
from palpate.protocols.study import Stimulus, Study, is_number

if TYPE_CHECKING:
    from palpate.protocols.procedures import Grid, Level, Procedure

ABSENT, EASY, NO_CATCH = "absent", "easy", "none"
PRACTICE = "practice"
Past = tuple[tuple[int, bool], ...]
"""The trials of a track so far, as (index of the level, hit)."""


@dataclass(frozen=True)
class Track:
    """A run of trials of a session: `levels` are all that may be presented, from the lowest to the highest.

    `stimuli` is one stimulus, whose columns are replaced by the level, or the row of the table for each level. `chance`
    is the key of random draws for this track in this session. `standard` is in the other intervals (None: they are
    blank), and `standard_level` is its level, where that is known.
    """

    name: str
    procedure: Procedure
    levels: tuple[Level, ...]
    stimuli: tuple[Stimulus, ...]
    chance: tuple[Key, ...]
    standard: Stimulus | None = None
    standard_level: float | None = None

    @property
    def trials(self) -> int:
        """Return the greatest number of trials."""
        return self.procedure.most_trials(len(self.levels))

    @property
    def easiest(self) -> int:
        """Return the index of the easiest level."""
        return len(self.levels) - 1 if self.procedure.easier == "higher" else 0

    def stimulus_at(self, index: int) -> Stimulus:
        """Return the stimulus at a level of the grid."""
        if len(self.stimuli) > 1:
            return self.stimuli[index]
        return with_level(self.stimuli[0], self.procedure.grids, self.levels[index])


def with_level(stimulus: Stimulus, grids: Sequence[Grid], level: Level) -> Stimulus:
    """Return the stimulus with a level in place of what its columns hold."""
    several = level if isinstance(level, tuple) else (level,)
    put_in = {grid.column: level_text(value) for grid, value in zip(grids, several, strict=True)}
    return stimulus.model_copy(update={"columns": {**stimulus.columns, **put_in}})


def path_of(study: Study, stimulus: Stimulus, column: str | None = None) -> tuple[str | int, ...]:
    """Return where the study file declares a stimulus at a level: its row, a procedure's levels, or the standard.

    `column` is the one in question (None: the stimulus as a whole).
    """
    place = [own.id for own in study.stimuli].index(stimulus.id)
    row = study.stimuli[place]
    if stimulus == row or (column is not None and stimulus.columns.get(column) == row.columns.get(column)):
        return ("stimuli", place)
    for n, procedure in enumerate(study.procedure):
        grids = procedure.grids
        if all(stimulus.columns.get(grid.column, "") in map(level_text, grid.levels) for grid in grids):
            return (*procedure_path(study, n), "level")
    return ("intervals", "standard")


def procedure_path(study: Study, place: int) -> tuple[str | int, ...]:
    """Return where the study file has its procedure of this number: several are in a list."""
    return ("procedure", place) if len(study.procedure) > 1 else ("procedure",)


def level_text(value: float) -> str:
    """Return a level as a text that gives the same number again, short where that is possible."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


@dataclass(frozen=True)
class Slot:
    """A place of the plan for a trial of a track; `index` is set where the level is fixed ahead."""

    block: str
    track: Track
    catch: str = NO_CATCH
    index: int | None = None

    @property
    def stimulus(self) -> Stimulus:
        """Return the stimulus that stands for the trial in the plan: the standard while the level is not known."""
        if len(self.track.stimuli) == 1:
            return self.track.stimuli[0]
        if self.index is not None or self.track.standard is None:
            return self.track.stimuli[self.index or 0]
        return self.track.standard


def tracks_in(study: Study, block: str, stimuli: Sequence[Stimulus], chance: tuple[Key, ...]) -> list[Track]:
    """Return the tracks of a block: one for each stimulus and procedure, or one a procedure if levels are rows.

    The standard of the study's intervals, if it is a row of the table, is in no track.
    """
    rows = {stimulus.id: stimulus for stimulus in study.stimuli}
    named = None if study.intervals.standard is None else rows.get(str(study.intervals.standard))
    tracks = []
    for procedure in study.procedure:
        among = procedure.stimuli
        compared = [s for s in stimuli if s is not named and (among is None or s.id in among)]
        if not compared:
            continue
        suffix = f" {procedure.name}" if len(study.procedure) > 1 else ""
        grids = procedure.grids
        if grids[0].of is not None:
            ordered = tuple(sorted(compared, key=lambda s: float(s.columns[grids[0].column])))
            levels: tuple[Any, ...] = tuple(float(s.columns[grids[0].column]) for s in ordered)
            members = [(f"{block}{suffix}", ordered)]
        else:
            levels = grids[0].levels if len(grids) == 1 else tuple(product(*(grid.levels for grid in grids)))
            members = [(f"{stimulus.id}{suffix}", (stimulus,)) for stimulus in compared]
        for name, own in members:
            standard, level = _standard(study, named, own[0], grids)
            tracks.append(Track(name, procedure, levels, own, (*chance, name), standard, level))
    return tracks


def _standard(
    study: Study, named: Stimulus | None, stimulus: Stimulus, grids: Sequence[Grid]
) -> tuple[Stimulus | None, float | None]:
    """Return what the levels of a track are compared with, and its level if that is known; (None, None) for blanks."""
    standard = study.intervals.standard
    if standard is None:
        return None, None
    if named is None:
        return with_level(stimulus, grids, float(standard)), float(standard)
    value = named.columns.get(grids[0].column, "")
    return named, float(value) if is_number(value) else None


def slots_of(track: Track, block: str, absent_every: int | None, easy_every: int | None) -> list[Slot]:
    """Return a track's slots in order: its trials, with a catch trial at a random place in every so many of them."""
    slots: list[Slot] = []
    for n in range(track.trials):
        slots.append(Slot(block, track))
        for catch, every, index in ((ABSENT, absent_every, None), (EASY, easy_every, track.easiest)):
            if every is not None and (n + 1) % every == 0:
                places = [str(place) for place in range(every + 1)]
                back = int(shuffled(places, "catch", catch, *track.chance, n)[0])
                slots.insert(len(slots) - min(back, len(slots)), Slot(block, track, catch, index))
    return slots


def practice_slots(study: Study, tracks: Sequence[Track]) -> Iterator[Slot]:
    """Yield the practice trials: the study's practice stimuli in turn, at their own level or else at the easiest."""
    if study.practice is None:
        return
    names = study.practice.stimuli
    for n in range(study.practice.at_most or len(names)):
        name = names[n % len(names)]
        for track in tracks:
            ids = [stimulus.id for stimulus in track.stimuli]
            if name in ids:
                index = track.easiest if len(ids) == 1 else ids.index(name)
                yield Slot(PRACTICE, replace(track, name=PRACTICE), index=index)
                break

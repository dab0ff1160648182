"""Choices among intervals as they were collected: which count, who is left out, and which function they belong to.

The collected table `choices` has one row for each answer. A track's design decides its psychometric function:

| design | hits | task | guess rate |
|---|---|---|---|
| forced_choice, oddity | `correct` | forced_choice | 1 / alternatives |
| forced_choice around a standard | `hit`: comparison chosen | symmetric | the lapse rate |
| yes_no, same_different | `hit`: "yes", "different" | yes_no | 95 % interval of the false alarms, else free |
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd
from scipy.special import betaincinv

from palpate.analysis.ratings.dataset import DataRefused, Exclusion
from palpate.analysis.ratings.own_answers import lines_of
from palpate.protocols.intervals import EQUAL
from palpate.protocols.pairs import PAIRS
from palpate.protocols.tracks import EASY, NO_CATCH, tracks_in

if TYPE_CHECKING:
    from palpate.protocols.study import Study
    from palpate.protocols.tracks import Track

TABLE = "choices"
ADAPTIVE = ("staircase", "questplus")
"""Procedures whose levels follow from the answers, so that they concentrate on a few."""
NOISE = ("noise", "same")
"""The targets of trials without a signal, or without a difference."""
NO_LEVELS = "pairs of stimuli have no levels, which this test needs; ask bradley_terry or thurstone"
TWO_DIMENSIONS = "the levels have two dimensions; a psychometric function has one"
GUESS_KNOWN = "the design of these choices decides `guess`, which is free in yes_no and same_different; leave it out"
NO_RIGHT_ANSWER = "no answer to a forced choice between two stimuli is correct, so it has no d'"
GUESSING = "a forced choice has a guess rate, which this model lacks; ask a psychometric test for each participant"
NO_SCALE = "a scale is of forced choices between the stimuli of pairs; "


def study_tracks(study: Study, group: str | None = None) -> dict[str, Track]:
    """Return the tracks that a study declares for a group (None: of all stimuli), by name; {} without a procedure."""
    if not study.procedure or study.intervals is None:
        return {}
    blocks = study.by_block(study.stimuli_of(group))
    return {track.name: track for block, own in blocks.items() for track in tracks_in(study, block, own, ())}


def common_tracks(study: Study) -> dict[str, Track]:
    """Return the tracks that have the same levels in every group of the study that has them."""
    by_group = [study_tracks(study, group) for group in study.groups or (None,)]
    return {
        name: track
        for own in by_group
        for name, track in own.items()
        if all(other.get(name, track) == track for other in by_group)
    }


def catch_lines(rows: Sequence[Mapping[str, Any]]) -> list[Exclusion]:
    """Return lines on catch trials among collected choices; they stay in the table.

    Those without a signal are half of a yes/no design. A psychometric function leaves all of them out.
    """
    catch = [row for row in rows if row["counts"] and not row["practice"] and row["catch"] != NO_CATCH]
    return lines_of("catch", catch, "catch trials have no place in a function")


def catch_exclusions(study: Study, choices: pd.DataFrame) -> list[Exclusion]:
    """Return a line for each participant whose share of wrong catch trials is above the study's `exclude_above`."""
    settings = getattr(getattr(study, "intervals", None), "catch", None)
    most = getattr(settings, "exclude_above", None)
    return [] if most is None or not len(choices) else inattentive(choices, float(most))


def inattentive(choices: pd.DataFrame, most: float) -> list[Exclusion]:
    """Return a line for each participant whose share of wrong catch trials is above `most`.

    A catch trial without a signal (absent) is wrong where it was a hit ("yes"), an easy one where it was not correct.
    """
    lines = []
    for who, rows in choices[choices["catch"] != NO_CATCH].groupby("participant", sort=True):
        absent = rows["catch"] == "absent"
        right = rows["correct"].where(rows["correct"].notna(), rows["hit"])
        wrong = int(np.where(absent, rows["hit"] == 1, right != 1).sum())
        if wrong / len(rows) > most:
            total = int((choices["participant"] == who).sum())
            why = f"{wrong} of {len(rows)} catch trials answered wrongly, above the study's {most:g}"
            lines.append(Exclusion("participant", str(who), why, total))
    return lines


@dataclass(frozen=True)
class TrackDesign:
    """The function that a track's design asks for: its task and alternatives, the column of hits, the procedure.

    `falling`: hits become rarer as the level rises, which is so where every level is below the standard. `nothing_at`:
    the standard where all levels lie on one side of it, since nothing is to be perceived there. `guess`: the
    bounds of the guess rate from trials without a signal (None: free). `catch`, `silent`: how many catch trials, and
    trials without a signal, are not in the fit. `easy`: how many catch trials at the easiest level are in it.
    """

    task: Literal["symmetric", "forced_choice", "yes_no"]
    alternatives: int | None
    hits: Literal["correct", "hit"]
    procedure: str
    falling: bool = False
    standard: float | None = None
    nothing_at: float | None = None
    guess: tuple[float, float] | None = None
    catch: int = 0
    silent: int = 0
    easy: int = 0

    @property
    def is_adaptive(self) -> bool:
        """Whether the levels followed from the answers."""
        return self.procedure in ADAPTIVE


def track_design(
    rows: pd.DataFrame, with_easy: bool = False, tracks: Mapping[str, Track] = MappingProxyType({})
) -> tuple[TrackDesign, pd.DataFrame]:
    """Return the function of one track's choices, and the rows that it is fitted to.

    `with_easy`: catch trials at the easiest level are among them, as they say how often somebody lapses. `tracks` of
    the study say which end of the levels is the easier, where no standard does. Raises
    DataRefused for pairs of stimuli, rows of several designs, procedures, standards or numbers of alternatives, for
    levels of two dimensions, and where no row has a level.
    """
    if (rows["procedure"].astype(str) == PAIRS).any():
        raise DataRefused(NO_LEVELS)
    kind = rows["catch"].astype(str)
    easy = kind == EASY if with_easy else pd.Series(False, index=rows.index)
    catch = (kind != NO_CATCH) & ~easy
    silent = ~catch & rows["target"].astype(str).isin(NOISE)
    used = rows[~catch & ~silent].dropna(subset=["level"])
    if not len(used):
        raise DataRefused("no trial with a level is among these choices")
    one = {name: _one(used, name) for name in ("design", "procedure", "alternatives", "standard")}
    if "level_2" in used.columns and used["level_2"].notna().any():
        raise DataRefused(TWO_DIMENSIONS)
    design, procedure, standard = str(one["design"]), str(one["procedure"]), one["standard"]
    alternatives = int(one["alternatives"])
    numbers: dict[str, Any] = {
        "catch": int(catch.sum()), "silent": int(silent.sum()), "easy": int(easy.sum()), "procedure": procedure,
    }  # fmt: skip
    level = used["level"].to_numpy(dtype=np.float64)
    below = standard is not None and bool((level < standard).any())
    above = standard is not None and bool((level > standard).any())
    numbers["nothing_at"] = standard if below != above else None
    easier = {tracks[name].procedure.easier for name in set(used["track"].astype(str)) & set(tracks)}
    falling = below if standard is not None and design != "yes_no" else easier == {"lower"}
    if design in ("yes_no", "same_different"):
        noise = rows[silent | (rows["catch"].astype(str) == "absent")]
        guess = _interval(int((noise["hit"] == 1).sum()), len(noise)) if len(noise) else None
        if design == "same_different" and below and above:
            raise DataRefused("levels on both sides of a standard differ from it more and more on each; ask about each")
        return TrackDesign("yes_no", None, "hit", falling=falling, standard=standard, guess=guess, **numbers), used
    if design not in ("forced_choice", "oddity"):
        raise DataRefused(f"design {design!r}: forced_choice, yes_no, same_different or oddity is expected")
    if below and above:
        if design == "oddity" or alternatives != 2:
            raise DataRefused("levels on both sides of a standard have a function in a forced choice of two only")
        return TrackDesign("symmetric", None, "hit", standard=standard, **numbers), used
    used = used[used["correct"].notna()]
    return TrackDesign("forced_choice", alternatives, "correct", falling=falling, standard=standard, **numbers), used


def compared_pairs(table: pd.DataFrame) -> tuple[pd.DataFrame, int]:
    """Return forced choices between pairs as comparisons, and how many pairs of a stimulus with itself are left out.

    Added are `winner`, `loser`, `tie` (whether neither was chosen); `stimulus` is the one that came first. Raises
    DataRefused for choices that are not of pairs, of another design, or with an answer that names neither interval.
    """
    if "other" not in table.columns or (table["procedure"].astype(str) != PAIRS).any():
        raise DataRefused(f"{NO_SCALE}here a procedure chose levels (column 'procedure')")
    if designs := sorted(set(table["design"].astype(str)) - {"forced_choice"}):
        raise DataRefused(f"{NO_SCALE}these are of design {', '.join(designs)}")
    if unknown := sorted(set(table["chosen"].astype(str)) - {"1", "2", EQUAL}):
        raise DataRefused(f"column 'chosen' has {unknown[0]!r}; 1, 2 or {EQUAL} is expected")
    used = table[table["stimulus"] != table["other"]].reset_index(drop=True)
    chosen = used["chosen"].astype(str)
    first, second = used["stimulus"], used["other"]
    won, lost = first.where(chosen != "2", second), second.where(chosen != "2", first)
    return used.assign(winner=won, loser=lost, tie=chosen == EQUAL), len(table) - len(used)


def several_values(name: str, values: Sequence[object]) -> str:
    """Return that choices with several values of a column have no function in common."""
    shown = ", ".join(map(str, values[:4]))
    return f"choices of several values of {name} ({shown}) have no function in common; name it in `by`"


def no_model_in_common(tracks: Sequence[str]) -> str:
    """Return that a study declares no model in common for these tracks, which a plan asks for."""
    return (
        f"the plan says `prior: declared_model`, and the study declares no model in common for track "
        f"{', '.join(tracks)}; leave `prior` out, or say `prior: levels`"
    )


def _one(rows: pd.DataFrame, name: str) -> Any:
    values = rows[name].dropna().unique().tolist() if name in rows.columns else []
    if len(values) > 1:
        raise DataRefused(several_values(name, values))
    if not values and name != "standard":
        raise DataRefused(f"column {name!r} has no value")
    return values[0] if values else None


def _interval(hits: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Clopper & Pearson 1934), at most 0.5."""
    low = float(betaincinv(hits, trials - hits + 1, 0.025)) if hits else 0.0
    high = float(betaincinv(hits + 1, trials - hits, 0.975)) if hits < trials else 1.0
    return min(low, 0.49), min(high, 0.5)

"""The answer about maps of groups, or of random halves of the participants, compared."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from palpate.analysis.plans.answers import Answer
from palpate.analysis.plans.asking.describing_rows import require_columns
from palpate.analysis.plans.asking.spaces_tables import configuration, gap_notes, profiles_of, rows_of, sentences
from palpate.analysis.ratings.dataset import DataRefused
from palpate.analysis.spaces.draws import stream
from palpate.analysis.spaces.procrustes import Procrustes as Compared
from palpate.analysis.spaces.procrustes import procrustes
from palpate.analysis.spaces.profiles import Profiles, of_people
from palpate.analysis.statistics.apa import apa_p
from palpate.analysis.statistics.labels import coded
from palpate.analysis.statistics.refusals import TooFew

if TYPE_CHECKING:
    from palpate.analysis.plans.answers import Row, Selected
    from palpate.analysis.plans.asking.spaces import Procrustes

MOST_SPLITS = 200


def procrustes_answer(selected: Selected, asked: Procrustes) -> Answer:
    """One row per pair of groups; or one for all splits into halves."""
    profiles = profiles_of(selected, asked)
    rows, more, headline = _halves(selected, asked, profiles) if asked.halves else _groups(selected, asked, profiles)
    between = "random halves of the participants" if asked.halves else f"levels of {asked.groups}"
    moved = "turned, shifted" + (", reflected" if asked.reflection else "") + (", stretched" if asked.stretch else "")
    return Answer(
        rows=rows,
        method=f"Procrustes fit of {asked.on} configurations of {between} ({moved}; Gower 1975)"
        + ("" if asked.halves else "; permutation test of r (Jackson 1995), p not adjusted"),
        kinds={
            "r": "Procrustes correlation of configurations of unit size",
            "m2": "1 - r squared",
            "squares": "sum of squared distances from the first group's points",
            "p": "p by permutation of the stimuli, not adjusted",
            "r_low": "lowest of the middle splits",
            "r_high": "highest of the middle splits",
        },
        participants=len(profiles.participants),
        values=int(selected.table["value"].notna().sum()),
        headline=headline,
        notes=sentences(gap_notes(profiles, selected)),
        more=more,
    )


def _groups(
    selected: Selected, asked: Procrustes, profiles: Profiles
) -> tuple[tuple[Row, ...], dict[str, tuple[Row, ...]], str]:
    parts = _members(selected, asked, profiles)
    rows: list[dict[str, Any]] = []
    residuals: list[dict[str, Any]] = []
    for (one, first), (two, second) in combinations(parts.items(), 2):
        found, people = _compared(selected, asked, profiles, first, second)
        rows.append(_row(one, two, people, found))
        for name, distance in found.residuals.items():
            residuals.append({"group_a": one, "group_b": two, asked.over: str(name), "residual": float(distance)})
    told = "; ".join(
        f"{row['group_a']} and {row['group_b']}: r = {row['r']:.2f}, {apa_p(row['p'])}" for row in rows[:3]
    )
    return tuple(rows), {"residuals": tuple(residuals)}, told


def _members(selected: Selected, asked: Procrustes, profiles: Profiles) -> dict[str, list[int]]:
    """The participants of each group, by their places."""
    require_columns(selected.table, (asked.groups,))
    own = selected.table[["participant", asked.groups]].drop_duplicates()
    if own["participant"].duplicated().any():
        who = sorted(set(map(str, own.loc[own["participant"].duplicated(), "participant"])))[:5]
        raise DataRefused(f"{asked.groups!r} has several levels for {', '.join(who)}; groups are of participants")
    level = {str(who): str(group) for who, group in zip(own["participant"], own[asked.groups], strict=True)}
    labels = [str(name) for name in coded(own[asked.groups].astype(object), asked.groups).labels]
    parts = {name: [i for i, who in enumerate(profiles.participants) if level[str(who)] == name] for name in labels}
    if len(parts) < 2:
        raise TooFew(f"{asked.groups!r} has one level, {labels[0]!r}; a comparison needs two (or `halves: true`)")
    return parts


def _compared(
    selected: Selected, asked: Procrustes, profiles: Profiles, first: list[int], second: list[int], test: bool = True
) -> tuple[Compared, tuple[int, int]]:
    """The fit of the second part's configuration to the first's, over the stimuli that both rated."""
    one, two = of_people(profiles, first), of_people(profiles, second)
    shared = [name for name in one.stimuli if name in set(two.stimuli)]
    if len(shared) < 3:
        raise TooFew(f"the two parts rated {len(shared)} stimuli in common; a comparison of maps needs three or more")
    maps = [configuration(_only(each, shared), asked, selected.seed) for each in (one, two)]
    drawn = {"draws": asked.draws or selected.draws, "seed": selected.seed} if test else {}
    found = procrustes(maps[0], maps[1], asked.stretch, asked.reflection, **drawn)
    return found, (len(first), len(second))


def _only(profiles: Profiles, shared: list[Any]) -> Profiles:
    kept = [i for i, name in enumerate(profiles.stimuli) if name in set(shared)]
    stimuli = tuple(profiles.stimuli[i] for i in kept)
    return Profiles(profiles.own[:, kept], profiles.offset, profiles.participants, stimuli, profiles.attributes)


def _row(one: str, two: str, people: tuple[int, int], found: Compared) -> dict[str, Any]:
    return {
        "group_a": one,
        "group_b": two,
        "participants_a": people[0],
        "participants_b": people[1],
        "stimuli": len(found.fitted),
        "r": found.r,
        "m2": found.m2,
        "squares": found.squares,
        "stretch": found.stretch,
        "reflected": found.reflection,
        "p": found.p,
        "draws": found.draws,
        "exact": found.exact,
    }


def _halves(
    selected: Selected, asked: Procrustes, profiles: Profiles
) -> tuple[tuple[Row, ...], dict[str, tuple[Row, ...]], str]:
    """How alike the maps of random halves are: the middle and the range of r over many splits; no p."""
    people = len(profiles.participants)
    if people < 4:
        raise TooFew(f"{people} participants; halves need two each")
    splits = min(asked.draws or selected.draws, MOST_SPLITS)
    rng = stream(selected.seed, "halves")
    found = []
    for _ in range(splits):
        order = rng.permutation(people).tolist()
        parts = sorted(order[: people // 2]), sorted(order[people // 2 :])
        found.append(_compared(selected, asked, profiles, *parts, test=False)[0].r)
    low, middle, high = np.quantile(found, [(1 - asked.confidence) / 2, 0.5, (1 + asked.confidence) / 2]).tolist()
    row: dict[str, Any] = {"splits": splits, "r": middle, "r_low": low, "r_high": high, "m2": 1 - middle * middle}
    each = rows_of(pd.DataFrame({"split": range(1, splits + 1), "r": found}))
    told = f"Maps of random halves agree with r = {middle:.2f} ({low:.2f} to {high:.2f} over {splits} splits)"
    return (row,), {"splits": each}, told

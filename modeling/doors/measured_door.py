"""Predicted ratings of the measured door and its four edits, and the profiles that the inverse method makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.modeling.doors.data import TOP, near_groups
from palpate.modeling.doors.domain import DoorDomain, FoldJob, train_job
from palpate.modeling.doors.folding import Fold
from palpate.modeling.doors.methods import Fitted
from palpate.modeling.doors.plausibility import reason_unplayable
from palpate.modeling.doors.profile_scores import perceivers_for
from palpate.modeling.doors.reading import read_profile
from palpate.modeling.doors.registry import Direction
from palpate.modeling.doors.results import MethodResults
from palpate.modeling.evaluate.intervals import half_widths
from palpate.signals.arrays import Array
from palpate.studies.catalogue import SHIPPED

STUDY = SHIPPED / "door_ratings"
FILES = {
    "actual": Path("profiles", "BC3_g0.csv"),
    **{f"edited_v{number}": Path("measured", "normalised", f"haptune_edited_v{number}.csv") for number in range(1, 5)},
}
"""File names of the source (HapTune), each with 621 points; `actual` is the door BC3_g0 of the study."""
SPLIT = "without the measured door"


def measured_doors() -> dict[str, Array]:
    """Return the forces (621,), in newtons, of the measured door (`actual`) and its four edits.

    They are read from files of studies/door_ratings, which `palpate doors normalise` made. Raises ModelDataError on a
    damaged file.
    """
    return {name: read_profile(STUDY / file) for name, file in FILES.items()}


@dataclass(frozen=True)
class Recovered:
    """One measured profile, rows of ratings each (attributes,) on 0..100.

    `rated` is its mean rating by people, None without any; `predicted` that of a model which never saw this door, with
    the half width of its interval. `made_N` (621,) is the profile that the inverse makes of the predicted ratings;
    `recovered` are the same model's ratings of it, `felt` those of fresh simulated people (None without any), and `why`
    is the reason why the door would not play it, None where it would.
    """

    name: str
    force_N: Array
    rated: Array | None
    predicted: Array
    half_width: Array | None
    made_N: Array
    recovered: Array
    felt: Array | None
    why: str | None


def recover_measured(
    domain: DoorDomain, methods: Mapping[Direction, str], forward: MethodResults
) -> tuple[Recovered, ...]:
    """Predict and recover the measured door and its edits by models of these methods, trained on the other doors.

    `forward` are the out-of-fold predictions of the forward method, which calibrate the intervals. Returns nothing
    where the data holds fewer than two other doors.
    """
    doors = measured_doors()
    others = _split_without(domain, np.array(list(doors.values())))
    if others is None:
        return ()
    models = {way: train_job(FoldJob(way, name, SPLIT, 0), others)[0] for way, name in methods.items()}
    try:
        width = half_widths(forward.predicted - forward.actual)
    except ValueError:
        width = None
    return tuple(_recover(others, name, force, models, width) for name, force in doors.items())


def _split_without(domain: DoorDomain, force_N: Array) -> DoorDomain | None:
    """Return the domain with one split, which trains on the doors that have none of these profiles (n, 621).

    None where fewer than two such doors are left.
    """
    data = domain.data
    groups = near_groups(np.concatenate([data.force_N, force_N]))
    same = np.isin(groups[: len(data)], groups[len(data) :])
    known = {door for door, is_same in zip(data.doors, same, strict=True) if is_same}
    test = np.array([door in known for door in data.doors], dtype=bool)
    if len({door for door in data.doors if door not in known}) < 2:
        return None
    fold = Fold(SPLIT, np.flatnonzero(~test), np.flatnonzero(test))
    return replace(domain, splits={SPLIT: (fold,)})


def _recover(
    domain: DoorDomain, name: str, force_N: Array, models: Mapping[Direction, Fitted], width: Array | None
) -> Recovered:
    predicted = models["forward"].predict(force_N[None])[0]
    made_N = models["inverse"].predict(np.clip(predicted, 0.0, TOP)[None])[0]
    people = perceivers_for(domain.data)
    felt = None if people is None else domain.scaling.rating_up(people.rate(made_N[None]))[0]
    # the stimuli that are this profile
    groups = near_groups(np.concatenate([domain.data.force_N, force_N[None]]))
    same = np.flatnonzero(groups[:-1] == groups[-1])
    return Recovered(
        name=name,
        force_N=force_N,
        rated=domain.scaling.rating_up(domain.data.rating[same]).mean(axis=0) if len(same) else None,
        predicted=predicted,
        half_width=width,
        made_N=made_N,
        recovered=models["forward"].predict(made_N[None])[0],
        felt=felt,
        why=reason_unplayable(made_N),
    )


def measured_rows(profiles: tuple[Recovered, ...], attributes: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return a row for each measured profile and attribute."""
    rows = []
    for profile in profiles:
        for column, attribute in enumerate(attributes):
            predicted = float(profile.predicted[column])
            reach = _at(profile.half_width, column)
            rows.append(
                {
                    "profile": profile.name,
                    "attribute": attribute,
                    "rated": _at(profile.rated, column),
                    "predicted": predicted,
                    "low": None if reach is None else predicted - reach,
                    "high": None if reach is None else predicted + reach,
                    "recovered": float(profile.recovered[column]),
                    "felt": _at(profile.felt, column),
                }
            )
    return rows


def _at(values: Array | None, column: int) -> float | None:
    return None if values is None else float(values[column])

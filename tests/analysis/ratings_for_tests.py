"""A small collected database, made row by row, and small data sets."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import pandas as pd
from sqlalchemy import Engine, create_engine, insert
from sqlalchemy.pool import StaticPool

from palpate.analysis.ratings.dataset import Ratings
from palpate.analysis.ratings.reading import Material, read_material
from palpate.studies.collecting import schema
from palpate.studies.collecting.collect import collect, open_database
from tests.test_recorded import LEDGERS

STUDY = "doors"
CARS = {"1": ("BC3", "FORD"), "2": ("K3", "K8")}
VARIANTS = ("g0", "g2", "g10")
ATTRIBUTES = (("Easy", "Hard", "physical"), ("Pleasant", "Unpleasant", "emotional"))


def definition(**changes: Any) -> dict[str, Any]:
    """Two groups of two cars, three variants each; the family follows from the variant, the file from the stimulus."""
    families = {"g0": "original", "g2": "amplitude", "g10": "amplitude"}
    stimuli = [
        {"id": f"{car}_{v}", "columns": {"file": f"{car}_{v}.csv", "car": car, "variant": v, "family": families[v]}}
        for cars in CARS.values()
        for car in cars
        for v in VARIANTS
    ]
    return {
        "study": STUDY,
        "task": "slider_rating",
        "stimuli": stimuli,
        "groups": {group: {"car": list(cars)} for group, cars in CARS.items()},
        "attributes": [{"low": low, "high": high, "category": category} for low, high, category in ATTRIBUTES],
        "scale": {"low": -10, "high": 10, "step": 1},
        "order": {"design": "williams"},
        **changes,
    }


def database() -> Engine:
    """An empty collected database in memory."""
    engine = create_engine("sqlite://", poolclass=StaticPool)
    with engine.begin() as connection:
        schema.create_all(connection)
    return engine


def add_study(engine: Engine, digest: str, stored: dict[str, Any]) -> None:
    """One version of a study."""
    row = {"study_digest": digest, "study": stored["study"], "title": None, "definition": json.dumps(stored)}
    with engine.begin() as connection:
        connection.execute(insert(schema.studies), [row])


def value_of(participant: str, stimulus: str, attribute: str) -> float:
    """A rating that tells rows apart: it depends on all three, within -10 to 10."""
    return float(sum(map(ord, participant + stimulus + attribute)) % 21 - 10)


def add_session(
    engine: Engine,
    participant: str,
    group: str | None,
    stimuli: Iterable[str],
    *,
    digest: str = "d1",
    number: int = 1,
    answered: int | None = None,
    practice: int = 0,
    **changes: Any,
) -> None:
    """A session that meets `stimuli` in order, the first `practice` ones for practice; `answered` ends it early."""
    planned = list(stimuli)
    answered_trials = planned[:answered]
    session = f"{STUDY}/{participant}/{number}"
    row = {
        "session": session, "number": number, "study": STUDY, "study_digest": digest, "participant": participant,
        "group_name": group,
        "row": 0, "seed": 1, "simulated": False, "status": "complete" if answered_trials == planned else "interrupted",
        "trials_planned": len(planned), "trials_answered": len(answered_trials), "events": 9, "first_hash": "a" * 64,
        "head_hash": "b" * 64, "file": f"{STUDY}_{participant}_s{number}.sqlite", "file_sha256": "c" * 64,
        "started_at": "2026-01-01T09:00:00Z", "sittings": 1, "duration_s": 60.0, "palpate_version": "0.1.0",
        "certificates": "{}", **changes,
    }  # fmt: skip
    trials = [
        {
            "session": session, "trial": t, "block": "1", "practice": t <= practice, "stimulus": stimulus,
            "attempts": 1, "status": "answered",
        }
        for t, stimulus in enumerate(answered_trials, 1)
    ]  # fmt: skip
    responses = [
        {
            "session": session, "trial": t, "attempt": attempt, "attribute": low, "antonym": high,
            "value": value_of(participant, stimulus, low) if attempt == 2 else 0.0, "response_time_s": 1.5,
            "revised": attempt == 2, "counts": attempt == 2,
        }
        for t, stimulus in enumerate(answered_trials, 1)
        for attempt in (1, 2)
        for low, high, _ in ATTRIBUTES
    ]  # fmt: skip
    with engine.begin() as connection:
        connection.execute(insert(schema.sessions), [row])
        if answered_trials:
            connection.execute(insert(schema.trials), trials)
            connection.execute(insert(schema.responses), responses)


def stimuli_of(group: str) -> list[str]:
    """The ids that a group rates."""
    return [f"{car}_{variant}" for car in CARS[group] for variant in VARIANTS]


def small_ratings(rows: Iterable[tuple[str, str, str, float]], **changes: Any) -> Ratings:
    """A data set of (participant, attribute, level, value)."""
    table = pd.DataFrame(list(rows), columns=["participant", "attribute", "level", "value"])
    fields = {
        "name": "small", "table": table, "within": ("level",), "between": (), "scale": None, "inputs": (),
        "attributes": tuple(dict.fromkeys(table["attribute"])),
    }  # fmt: skip
    return Ratings(**(fields | changes))


def recorded_material() -> Material:
    """Return what the recorded sessions of `doors_small` give an analysis plan."""
    engine = open_database("sqlite://")
    list(collect(LEDGERS, engine))
    material = read_material(engine, "doors_small", digest=None, include_incomplete=False, simulated=None)
    engine.dispose()
    return material

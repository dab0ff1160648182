"""Ratings by simulated people, in memory and through the real runner: what models are tried on before people rate."""

from __future__ import annotations

from pathlib import Path

from palpate.modeling.doors.data import DoorData, ModelDataError
from palpate.modeling.doors.rated import Rated

LEAST_PEOPLE = 2
"""A study of two groups shows everybody only its group's doors."""


def simulated_data(people: int = 40, seed: int = 1, study: Path | None = None) -> DoorData:
    """Mean ratings by `people` simulated persons P001, P002, ... of the shipped door_ratings, or of a study file.

    Each has a session of the real runner and a perceiver of the study's `simulation`; the same people and seed give
    the ratings that `palpate run --simulate` records. Raises ModelDataError where a stimulus is left without ratings.
    """
    return simulated_ratings(people, seed, study).data


def simulated_ratings(people: int = 40, seed: int = 1, study: Path | None = None) -> Rated:
    """As `simulated_data`, with each person's own ratings beside the means."""
    from palpate.analysis.power.simulated_studies import people as pseudonyms
    from palpate.analysis.power.simulated_studies import simulated_material
    from palpate.modeling.doors.reading import rated_material
    from palpate.studies.catalogue import SHIPPED, STUDY_FILE, read_study

    if people < LEAST_PEOPLE:
        raise ModelDataError(f"{people} simulated people: at least {LEAST_PEOPLE} are needed, one for each group")
    found = read_study(study or SHIPPED / "door_ratings" / STUDY_FILE)
    material = simulated_material(found.study, found.folder, pseudonyms(people), seed)
    told = f"{people} simulated people, seed {seed}: {material.inputs[0].name} {material.inputs[0].sha256}"
    return rated_material(material, found.folder, made_from=(told,))

"""The shipped studies, and short sessions of each."""

from __future__ import annotations

from functools import cache

from palpate.protocols.plan import Plan, compile_plan
from palpate.studies.catalogue import SHIPPED, StudyFiles, read_study
from palpate.studies.participants.row_assignment import allocate
from tests.protocols.every_task import LAB

TEN = (
    "door_adjectives",
    "door_authoring",
    "door_capture",
    "door_lexicon",
    "door_matching",
    "door_ratings",
    "texture_adjectives",
    "texture_capture",
    "texture_ratings",
    "texture_similarity",
)
ALL = (
    *TEN,
    "roughness_discrimination",
    "roughness_magnitude",
    "texture_preference",
    "texture_questions",
    "vibration_threshold",
)
"""TEN have recorded sessions; photographs have a rig of their own, and are in neither."""
GROUPS = {"door_capture": "pilot", "texture_capture": "pilot"}
"""Where a study has a group that checks the rig, a short session is one of that."""


@cache
def read_shipped(name: str) -> StudyFiles:
    """A shipped study with its folder."""
    return read_study(SHIPPED / name / "study.yaml")


@cache
def plan_for(name: str, participant: str = "P001", seed: int = 1) -> Plan:
    """One participant's plan, with a lab's consent text and questions."""
    study = read_shipped(name).study
    return compile_plan(study, allocate(study, participant, GROUPS.get(name)), seed, LAB)

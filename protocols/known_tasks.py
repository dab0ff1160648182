"""The tasks by name, each in its module, so that reading a study file imports the task that it names and no other.

So a session imports only the task that its study names; tests/test_palpate.py checks what a rating session imports.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from palpate.protocols.registry import Registry, place_in

_TASKS = "palpate.protocols.tasks"
_PLACES: Mapping[str, str] = {
    "slider_rating": f"{_TASKS}.rating:SLIDER_RATING",
    "matching": f"{_TASKS}.rating:MATCHING",
    "similarity": f"{_TASKS}.rating:SIMILARITY",
    "adjective_selection": f"{_TASKS}.words:ADJECTIVE_SELECTION",
    "free_lexicon": f"{_TASKS}.words:FREE_LEXICON",
    "authoring": f"{_TASKS}.rating:AUTHORING",
    "capture": f"{_TASKS}.capture:CAPTURE",
    "questions": f"{_TASKS}.questions:QUESTIONS",
}
_SHARED = {"steps", "rating", "words", "capture", "questions", "intervals_checks"}
"""Modules of the folder that are not named like a task."""
_OF_THEIR_OWN = sorted(
    module.name for module in iter_modules([str(Path(__file__).with_name("tasks"))]) if module.name not in _SHARED
)
TASKS: Registry[Any] = Registry(
    {**_PLACES, **{name: place_in(_TASKS, name, "TASK") for name in _OF_THEIR_OWN}},
    kind="tasks",
    of="palpate.protocols.tasks.steps:Task",
)
"""The tasks: in the table above, or `TASK` of a module in `protocols/tasks/` that is named like the task."""
FORM_PLACES: Mapping[str, str] = {name: place_in(_TASKS, name, "FORM") for name in _OF_THEIR_OWN}
"""The places of forms that come with a task: such a module, named like the task, has both `TASK` and `FORM`."""

"""The tasks: their keys in a study file, their forms, and the steps of their trials. A new task is a module here.

A module that is named like its task, with `TASK` and `FORM`, is found by its name, and its form's screen is the module
of the same name in `devices/window/screens/`; a task that shares a form has a line in `palpate.protocols.known_tasks`.
"""

from __future__ import annotations

from palpate.protocols import known_tasks
from palpate.protocols.registry import Registry
from palpate.protocols.study import Study
from palpate.protocols.tasks.steps import (
    Answered,
    Captured,
    Outcome,
    Steps,
    Stopped,
    Task,
    TaskError,
    WentBack,
    feel_anchor,
)

TASKS: Registry[Task] = known_tasks.TASKS


def gives_ratings(study: Study) -> bool:
    """Return whether the answers of the study's trials are ratings of its attributes."""
    return TASKS[study.task].answers == "ratings"


__all__ = [
    "TASKS",
    "Answered",
    "Captured",
    "Outcome",
    "Steps",
    "Stopped",
    "Task",
    "TaskError",
    "WentBack",
    "feel_anchor",
    "gives_ratings",
]

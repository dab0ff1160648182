"""Where each task is described: names alone, so that reading a study file imports none of them."""

from __future__ import annotations

from collections.abc import Mapping

_TASKS = "palpate.protocols.tasks"
TASK_PLACES: Mapping[str, str] = {
    "slider_rating": f"{_TASKS}.rating:SLIDER_RATING",
    "matching": f"{_TASKS}.rating:MATCHING",
    "similarity": f"{_TASKS}.rating:SIMILARITY",
    "adjective_selection": f"{_TASKS}.words:ADJECTIVE_SELECTION",
    "free_lexicon": f"{_TASKS}.words:FREE_LEXICON",
    "authoring": f"{_TASKS}.rating:AUTHORING",
    "capture": f"{_TASKS}.capture:CAPTURE",
}

"""The task that asks questions of several kinds about a stimulus, each with a scale and an answer time of its own.

With one number above 0 it is magnitude estimation: with a free modulus, or with a standard among the study's `anchors`.
"""

from __future__ import annotations

from collections.abc import Iterator

from palpate.protocols.complaints import Problem
from palpate.protocols.fields import Fields
from palpate.protocols.study import Study
from palpate.protocols.tasks.steps import Task, feel_and_answer
from palpate.protocols.wording import phrase


def _not_about_intervals(study: Study) -> Iterator[Problem]:
    for n, question in enumerate(study.ask):
        if question.is_about_intervals:
            yield Problem(("ask", n, "of"), "this task has no intervals to choose from; give options: [TEXT, ...]")


QUESTIONS = Task(
    "A stimulus is felt, and questions of several kinds about it are answered.",
    feel_and_answer, keys=("ask",), required=("ask",), form=lambda study, *_session: Fields(study.ask),
    answers="fields", check=_not_about_intervals,
    summary=lambda study: f"asks {phrase([question.name for question in study.ask])}",
)  # fmt: skip

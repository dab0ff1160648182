"""The task: a finger is touched, the participant says which one it was and how sure, and may hear if it was right.

The questions are the study's `ask:`; the choice named `finger` has the fingers as its options. A stimulus says in its
column `finger` which one is touched, by a hand or a vibrator.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from palpate.protocols.complaints import Problem
from palpate.protocols.events import Ask, Present, Reply, Show
from palpate.protocols.fields import Choice, Confidence, Fields, QuestionSpec, answered
from palpate.protocols.forms import FormKind, OwnColumn, OwnTable
from palpate.protocols.keyed import normal
from palpate.protocols.strict import Strict
from palpate.protocols.study import Study
from palpate.protocols.tasks.intervals import RIGHT, WRONG
from palpate.protocols.tasks.steps import Steps, Task, TaskError, outcome_of
from palpate.protocols.trial import ParticipantRow, Trial

FINGER = "finger"
"""The name of the question which finger it was, and of the column of stimuli with the touched one."""
FEEDBACK_S = 0.8


class Settings(Strict):
    """The task's `settings:` in a study file: whether each answer is followed by a page that says if it was right."""

    feedback: bool = False


@dataclass(frozen=True)
class FingerForm(Fields):
    """The questions of a trial, and whether feedback follows."""

    name: str = "fingers.localise"
    feedback: bool = False


def touch_and_name(trial: Trial) -> Steps:
    """Touch the finger, ask which one it was, and show whether that was right."""
    form, touched = trial.form, trial.stimulus.columns[FINGER]
    if not isinstance(form, FingerForm):
        raise TaskError(f"trial {trial.number}: nothing to ask")
    yield Present(trial)
    reply = yield Ask(replace(form, context={"touched": touched}), trial)
    if form.feedback:
        yield Show(RIGHT if reply.value["answers"][FINGER] == touched else WRONG, FEEDBACK_S, trial)
    return outcome_of(reply)


def form_of_study(study: Study, _who: ParticipantRow, _seed: int, _session: int) -> FingerForm:
    """Return the form of every trial."""
    return FingerForm(study.ask, feedback=gives_feedback(study))


def gives_feedback(study: Study) -> bool:
    """Return whether each answer is followed by feedback."""
    return isinstance(study.settings, Settings) and study.settings.feedback


def fingers_named(questions: Sequence[QuestionSpec]) -> tuple[str, ...]:
    """Return the fingers that can be named; () where no question asks for one."""
    return next((q.options for q in questions if isinstance(q, Choice) and q.name == FINGER), ())


def problems(study: Study) -> Iterator[Problem]:
    """Yield a problem unless the study asks which finger it was, and touches only fingers that can be named."""
    names = fingers_named(study.ask)
    if not names:
        yield Problem(("ask",), f"a question {{name: {FINGER}, kind: choice, options: [...]}} is expected")
    for stimulus in study.stimuli if names else ():
        if (touched := stimulus.columns.get(FINGER)) not in names:
            yield Problem(
                ("stimuli",), f"{stimulus.id}: {FINGER} is {touched!r}; one of {', '.join(names)} is expected"
            )


def simulate(person: Any, ask: Ask, form: FingerForm) -> tuple[Reply, float]:
    """Name the finger next to which the touch is felt: its place is off by noise, the more so the less sure."""
    fingers = fingers_named(form.questions)
    off = person.simulation.noise_sd * normal(*person.moment("felt", ask, FINGER))
    felt = fingers.index(form.context["touched"]) + off
    named = min(max(round(felt), 0), len(fingers) - 1)
    doubt = min(1.0, 2.0 * abs(felt - named))
    answers = {question.name: question.simulated(1.0 - doubt) for question in form.questions}
    return answered(person, ask, {**answers, FINGER: fingers[named]})


def rows(
    form: FingerForm, answers: Mapping[str, Any], reply: Mapping[str, Any], request: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the row of a trial for the table `fingers_answers`."""
    touched = request["context"]["touched"]
    yield {
        "touched": touched,
        "named": answers[FINGER],
        "right": answers[FINGER] == touched,
        "sure": next((float(answers[q.name]) for q in form.questions if isinstance(q, Confidence)), None),
        "response_time_s": reply["at_s"][FINGER],
    }


LOCALISE = Task(
    "A finger is touched, and the participant says which one it was.",
    touch_and_name,
    keys=("ask", "settings"),
    required=("ask",),
    form=form_of_study,
    settings=Settings,
    answers="fingers_answers",
    forward_only=True,
    check=problems,
    summary=lambda study: "which finger was touched" + (", with feedback" if gives_feedback(study) else ""),
)
QUESTIONS = FormKind(
    "naming the touched finger",
    simulate,
    screen="palpate.devices.window.screens.fields:FieldsScreen",
    table=OwnTable(
        "fingers_answers",
        "One row for each touch that was named.",
        (
            OwnColumn("touched", "The finger that was touched."),
            OwnColumn("named", "The finger that the participant named."),
            OwnColumn("right", "Whether it was the same.", "truth"),
            OwnColumn("sure", "How sure the participant was; empty if the study does not ask.", "number"),
            OwnColumn("response_time_s", "When the finger was named, from the form's appearance.", "number", "s"),
        ),
        rows,
    ),
)

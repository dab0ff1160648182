"""Tasks that rate attributes on a scale: of a stimulus, of two sides, or of a stimulus made from a setting."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from palpate.protocols.complaints import Problem
from palpate.protocols.events import Ask, Present
from palpate.protocols.forms import Sliders
from palpate.protocols.study import Study
from palpate.protocols.tasks.steps import Steps, Task, feel_and_answer, form_of, outcome_of
from palpate.protocols.trial import ParticipantRow, Trial
from palpate.protocols.wording import count

RATED = ("attributes", "scale")


def author(trial: Trial) -> Steps:
    """Set sliders and feel what is made from them, as often as the participant likes (thesis 5.7.2.1).

    The last setting counts. If the form is live, the sliders were moved while the stimulus was felt: the next form
    starts from their last positions.
    """
    former: Mapping[str, Any] | None = None
    while True:
        reply = yield Ask(form_of(trial), trial, former)
        if reply.value.get("go") != "try":
            return outcome_of(reply)
        former = reply.value["answers"]
        felt = yield Present(trial, wish=former)
        former = felt.value.get("left_at", former)


def _sliders(study: Study, _who: ParticipantRow, _seed: int, _session: int, tries: bool = False) -> Sliders | None:
    if study.scale is None:
        return None
    live = study.live
    return Sliders(
        study.attributes, study.scale, study.sides, tries=tries, live=live is not None,
        shows_force=live is not None and live.show_force,
    )  # fmt: skip


def _rated(study: Study) -> str:
    on = "" if study.scale is None else f" on {study.scale.low}..{study.scale.high}"
    return f"{count(len(study.attributes), 'attribute')}{on}"


def _two_sides(study: Study) -> Iterator[Problem]:
    if len(set(study.sides)) < 2:
        yield Problem(("sides",), "two different sides to switch between are expected, as [real, virtual]")


SLIDER_RATING = Task(
    "A stimulus is felt and rated on bipolar attributes.",
    feel_and_answer, keys=RATED, required=RATED, form=_sliders, answers="ratings", summary=_rated,
)  # fmt: skip
MATCHING = Task(
    "A stimulus that was made for a wish is felt and rated on bipolar attributes.",
    feel_and_answer, keys=RATED, required=RATED, form=_sliders, answers="ratings", summary=_rated,
)  # fmt: skip
SIMILARITY = Task(
    "Two sides are felt in turns, and their similarity is rated.",
    feel_and_answer, keys=(*RATED, "sides"), required=RATED, form=_sliders, answers="ratings", summary=_rated,
    check=_two_sides,
)  # fmt: skip
AUTHORING = Task(
    "Attributes are set, what is made for them is felt, until it is as wished.",
    author, keys=(*RATED, "live"), required=RATED, form=partial(_sliders, tries=True), answers="ratings",
    summary=_rated, forward_only=True, makes=True, device=lambda _study: "door_generator",
)  # fmt: skip

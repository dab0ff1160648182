"""Tasks that are answered by words: ticked on a list, or written by the participant."""

from __future__ import annotations

from palpate.protocols.forms import Lexicon, Words
from palpate.protocols.keyed import shuffled
from palpate.protocols.study import Study
from palpate.protocols.tasks.steps import Task, feel_and_answer
from palpate.protocols.trial import ParticipantRow


def _list_of(study: Study, who: ParticipantRow, seed: int, session: int) -> Words | None:
    """Return the list of words, shuffled by participant and session if the study says so."""
    if study.adjectives is None:
        return None
    words = [adjective.word for adjective in study.adjectives.words]
    if study.adjectives.order == "random":
        again = (session,) if session > 1 and study.over_sessions == "next_row" else ()
        words = list(shuffled(words, "words", study.study, seed, who.participant, *again))
        words = words[::-1] if study.is_mirrored(session) else words
    return Words(tuple(words), study.adjectives.further)


ADJECTIVE_SELECTION = Task(
    "A stimulus is felt, and the adjectives of a list that describe it are ticked.",
    feel_and_answer, keys=("adjectives",), required=("adjectives",), form=_list_of, answers="words",
    summary=lambda study: f"{len(study.adjectives.words if study.adjectives else ())} adjectives to tick",
)  # fmt: skip
FREE_LEXICON = Task(
    "A stimulus is felt and described in words of the participant's own.",
    feel_and_answer, keys=("lexicon",), answers="words",
    form=lambda study, *_session: Lexicon(study.lexicon.at_least if study.lexicon is not None else 1),
    summary=lambda _study: "words of the participant's own",
)  # fmt: skip

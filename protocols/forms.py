"""The forms that can be put before a participant: what each holds, and what counts as an answer to it.

A reply's value holds `answers`, in a shape that the form fixes; how and when they were given may stand beside it.
`FORMS` says of each form, by its name in the ledger, what the rest of the platform needs to know of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, Literal, Protocol

from palpate.protocols.known_tasks import FORM_PLACES
from palpate.protocols.registry import Registry, lazy_function
from palpate.protocols.study import Anchor, Attribute, Criterion, Item, Questionnaire, Scale

LONGEST_WORD = 200
MOST_WORDS = 200


class Form(Protocol):
    """What is put before a participant, as plain data.

    A form that may be left and come back to (go: try) has `tries = True`, and `unfinished(answers)`, where there is
    one, says why answers to it are none to go on with.
    """

    @property
    def name(self) -> str:
        """The form's name in the ledger and in `FORMS`."""

    def items(self) -> list[str]:
        """Return the names of what is answered."""

    def problem(self, answers: Any) -> str | None:
        """Return why these are no answers, or None."""


@dataclass(frozen=True)
class Sliders:
    """Bipolar attributes, each rated on the scale: {attribute: number}.

    `sides` are two or more things that the participant switches between while rating; `tries` marks a form whose
    answers may be tried out (go: try) before they are final. `live` forms stay on while what is tried is felt, and it
    follows them; `shows_force` draws what is made.
    """

    attributes: tuple[Attribute, ...]
    scale: Scale
    sides: tuple[str, ...] = ()
    tries: bool = False
    live: bool = False
    shows_force: bool = False

    @property
    def name(self) -> str:
        """The form's name in the ledger."""
        return "similarity" if self.sides else "authoring" if self.tries else "sliders"

    def items(self) -> list[str]:
        """The attributes' names."""
        return [attribute.name for attribute in self.attributes]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        for name, answer in answers.items():
            if not self.scale.holds(answer):
                return f"{name} = {answer!r} is not on the study's scale"
        return None


@dataclass(frozen=True)
class Words:
    """Adjectives to tick, in the order they are shown: {ticked: [word, ...], further: [word, ...]}."""

    words: tuple[str, ...]
    further: bool = False
    name: Literal["adjectives"] = "adjectives"

    def items(self) -> list[str]:
        """The words, as shown."""
        return list(self.words)

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        if not isinstance(answers, Mapping) or set(answers) != {"ticked", "further"}:
            return f"ticked and further words expected, found {answers!r:.200}"
        ticked, further = answers["ticked"], answers["further"]
        if not _texts(ticked) or len(set(ticked)) != len(ticked) or not set(ticked) <= set(self.words):
            return f"ticked = {ticked!r:.200}: different words of the list are expected"
        if further and not self.further:
            return "further words, which the study does not ask for"
        return None if _texts(further) else f"further = {further!r:.200}: words are expected"


@dataclass(frozen=True)
class Lexicon:
    """Words of the participant's own, at least so many: {words: [word, ...]}."""

    at_least: int = 1
    name: str = "lexicon"

    def items(self) -> list[str]:
        """One item."""
        return ["words"]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        if not isinstance(answers, Mapping) or set(answers) != {"words"} or not _texts(answers["words"]):
            return f"words expected, found {answers!r:.200}"
        found = len(answers["words"])
        return None if found >= self.at_least else f"at least {self.at_least} words expected, found {found}"


@dataclass(frozen=True)
class Likert:
    """Items with labelled ends, each answered by a whole number from 1 to `points`: {item: number}."""

    questionnaire: Questionnaire
    name: Literal["likert"] = "likert"

    def items(self) -> list[str]:
        """The items' names."""
        return [item.name for item in self.questionnaire.items]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        points = self.questionnaire.points
        for name, answer in answers.items():
            if type(answer) is not int or not 1 <= answer <= points:
                return f"{name} = {answer!r}: a whole number from 1 to {points} is expected"
        return None


@dataclass(frozen=True)
class Question:
    """One question about the participant; `levels` are (value, label) pairs, low and high bound a number."""

    name: str
    text: str
    kind: Literal["number", "choice", "text"]
    levels: tuple[tuple[str, str], ...] = ()
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    optional: bool = True

    def problem(self, answer: Any) -> str | None:
        """Why this is no answer, or None; null is one where the question is optional."""
        if answer is None:
            return None if self.optional else f"{self.name} is not answered"
        match self.kind:
            case "number":
                fits = type(answer) in (int, float) and (
                    (self.low is None or answer >= self.low) and (self.high is None or answer <= self.high)
                )
                return None if fits else f"{self.name} = {answer!r}: {self._expected()} is expected"
            case "choice":
                values = [value for value, _ in self.levels]
                return None if answer in values else f"{self.name} = {answer!r}: one of {values} is expected"
            case _:
                known = isinstance(answer, str) and 0 < len(answer) <= LONGEST_WORD
                return None if known else f"{self.name} = {answer!r:.80}: a text is expected"

    def _expected(self) -> str:
        bounds = [
            f"from {self.low:g}" if self.low is not None else "",
            f"to {self.high:g}" if self.high is not None else "",
        ]
        return " ".join(["a number", *(bound for bound in bounds if bound)])


@dataclass(frozen=True)
class Demographics:
    """Questions about the participant: {question: answer or null}."""

    questions: tuple[Question, ...]
    name: Literal["demographics"] = "demographics"

    def items(self) -> list[str]:
        """The questions' names."""
        return [question.name for question in self.questions]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        return next(filter(None, (question.problem(answers[question.name]) for question in self.questions)), None)


@dataclass(frozen=True)
class Consent:
    """The consent text, agreed to or not: {agreed: true or false}. Who declines takes no part."""

    text: str
    name: Literal["consent"] = "consent"

    def items(self) -> list[str]:
        """One item."""
        return ["agreed"]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        good = isinstance(answers, Mapping) and set(answers) == {"agreed"} and type(answers["agreed"]) is bool
        return None if good else f"agreed: true or false expected, found {answers!r:.80}"


@dataclass(frozen=True)
class Interview:
    """Questions that are answered in the participant's own words, or left empty: {question: text}."""

    questions: tuple[Item, ...]
    name: Literal["interview"] = "interview"

    def items(self) -> list[str]:
        """The questions' names."""
        return [question.name for question in self.questions]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        for name, answer in answers.items():
            if not isinstance(answer, str) or len(answer) > LONGEST_WORD * MOST_WORDS:
                return f"{name} = {answer!r:.80}: a text is expected"
        return None


@dataclass(frozen=True)
class Eligibility:
    """Questions that decide whether the person can take part: {eligible: true or false}.

    Which of them was answered how is nobody's to know: only the outcome leaves the screen.
    """

    criteria: tuple[Criterion, ...]
    name: Literal["eligibility"] = "eligibility"

    def items(self) -> list[str]:
        """One item."""
        return ["eligible"]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        good = isinstance(answers, Mapping) and set(answers) == {"eligible"} and type(answers["eligible"]) is bool
        return None if good else f"eligible: true or false expected, found {answers!r:.80}"


@dataclass(frozen=True)
class AnchorForm:
    """A reference stimulus, number `number` of `of` before its block: {felt: how often it was felt}.

    It is felt as often as wished (go: try), once at least. `wish` is what it is made from, complete.
    """

    anchor: Anchor
    block: str
    number: int
    of: int
    wish: Mapping[str, float] | None = None
    tries: Literal[True] = True
    name: Literal["anchor"] = "anchor"

    def items(self) -> list[str]:
        """One item."""
        return ["felt"]

    def problem(self, answers: Any) -> str | None:
        """Why these are no answers, or None."""
        good = isinstance(answers, Mapping) and set(answers) == {"felt"} and type(answers["felt"]) is int
        return None if good and answers["felt"] >= 0 else f"felt: a whole number expected, found {answers!r:.80}"

    def unfinished(self, answers: Mapping[str, Any]) -> str | None:
        """Why these answers are none to go on with, or None."""
        return "the reference was not felt yet" if answers == {"felt": 0} else None

    def describe(self) -> dict[str, Any]:
        """Return what the ledger keeps of the reference beside its stimulus."""
        place = {"number": self.number, "of": self.of, "block": self.block}
        return {**place, **self.anchor.model_dump(mode="json", exclude_none=True)}


@dataclass(frozen=True)
class OwnColumn:
    """A column of an `OwnTable`, and what it means; with the number of the reply, `key` columns name a row."""

    name: str
    description: str
    kind: Literal["text", "number", "whole", "truth"] = "text"
    unit: str = ""
    key: bool = False


@dataclass(frozen=True)
class OwnTable:
    """A collected table of one form's answers, which are numbers by item.

    `rows` makes its rows of an answered form in a trial: from the form, what was answered, and the whole reply. Whose
    answer it was, in which trial, and whether it counts is added to each row by those who collect.
    """

    name: str
    description: str
    columns: tuple[OwnColumn, ...]
    rows: Callable[[Any, Mapping[str, Any], Mapping[str, Any]], Iterable[dict[str, Any]]]


@dataclass(frozen=True)
class FormKind:
    """A kind of form, by its name in the ledger.

    `doing` is what the console says while it is answered, with {n} for the number of items. `simulate` returns a
    simulated participant's reply and the seconds that it took, from the participant, the request and the form. `table`
    is the collected table of the answers; None: `responses` for numbers by item in a trial, else `answers`, where
    `answer_kind` says what each answer is, or that its question says it. `title` names the form in exports; forms
    without one are not exported. `timed` screens record samples from the time at which they are shown.
    """

    doing: str
    simulate: Callable[..., Any]
    table: Literal["words", "anchors"] | OwnTable | None = None
    answer_kind: Literal["text", "points", "agreed", "by question"] = "text"
    title: str = ""
    timed: bool = False


FORMS: Registry[FormKind] = Registry(
    FORM_PLACES,
    parts={
        "sliders": FormKind("rating {n} attribute(s)", lazy_function("palpate.protocols.answering:rate"), timed=True),
        "similarity": FormKind(
            "switching sides and rating {n} attribute(s)",
            lazy_function("palpate.protocols.answering:compare"),
            timed=True,
        ),
        "authoring": FormKind("setting {n} slider(s)", lazy_function("palpate.protocols.answering:author"), timed=True),
        "adjectives": FormKind(
            "ticking adjectives, {n} word(s)",
            lazy_function("palpate.protocols.answering:tick_words"),
            table="words",
            title="words to tick",
        ),
        "lexicon": FormKind(
            "writing adjectives",
            lazy_function("palpate.protocols.answering:write_words"),
            table="words",
            title="words of one's own",
        ),
        "suggestions": FormKind(
            "suggesting further adjectives",
            lazy_function("palpate.protocols.answering:write_words"),
            table="words",
            title="suggestions at the end",
        ),
        "demographics": FormKind(
            "answering {n} question(s) about themselves",
            lazy_function("palpate.protocols.answering:describe_oneself"),
            answer_kind="by question",
            title="about the person",
        ),
        "likert": FormKind(
            "answering {n} statement(s)",
            lazy_function("palpate.protocols.answering:rate_statements"),
            answer_kind="points",
            title="the questionnaire",
        ),
        "interview": FormKind(
            "answering {n} question(s) in their own words",
            lazy_function("palpate.protocols.answering:leave_empty"),
            title="free text",
        ),
        "eligibility": FormKind(
            "answering whether they can take part", lazy_function("palpate.protocols.answering:agree")
        ),
        "consent": FormKind(
            "reading the consent form", lazy_function("palpate.protocols.answering:agree"), answer_kind="agreed"
        ),
        "anchor": FormKind(
            "getting to know a reference", lazy_function("palpate.protocols.answering:feel_reference"), table="anchors"
        ),
    },
)
"""The kinds of forms by their names in the ledger; a task with a module of its own brings one (`FORM`)."""


def table_of(name: Any) -> str | None:
    """Return the table of a form's own answers, by its name in a ledger; None where it has none, or is unknown."""
    kind = FORMS.get(name) if isinstance(name, str) else None
    table = None if kind is None else kind.table
    return table.name if isinstance(table, OwnTable) else table


@cache
def own_tables() -> Mapping[str, OwnTable]:
    """Return the tables that forms bring with them, by their names."""
    tables = (FORMS[name].table for name in FORM_PLACES)
    return {table.name: table for table in tables if isinstance(table, OwnTable)}


@dataclass(frozen=True)
class LabForms:
    """What a lab puts before every participant: its consent text and its questions about the person."""

    consent: str
    questions: tuple[Question, ...]

    def definition(self) -> dict[str, Any]:
        """The forms as JSON data, for the ledger."""
        return {"consent": self.consent, "questions": [asdict(question) for question in self.questions]}

    @classmethod
    def from_definition(cls, data: Mapping[str, Any]) -> LabForms:
        """The forms that a ledger holds."""
        questions = [
            Question(**{**question, "levels": tuple((value, label) for value, label in question["levels"])})
            for question in data["questions"]
        ]
        return cls(data["consent"], tuple(questions))


def _texts(value: Any) -> bool:
    """Whether the value is a list of at most so many texts of a sensible length."""
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) > MOST_WORDS:
        return False
    return all(isinstance(word, str) and 0 < len(word.strip()) <= LONGEST_WORD for word in value)

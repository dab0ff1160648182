"""The forms that a participant can be shown: what each contains, and which answers to it are valid.

A reply's value holds `answers`, in a shape that the form defines, possibly with details such as times. `FORMS`
describes each form, by its name in the ledger, for the rest of the platform.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, Protocol

from palpate.protocols.extensions import ExtensionError, extension_of, is_own
from palpate.protocols.known_tasks import FORM_PLACES
from palpate.protocols.registry import Registry, lazy_function
from palpate.protocols.study import Anchor, Attribute, Criterion, Item, Questionnaire, Scale

LONGEST_WORD = 200
MOST_WORDS = 200


class Form(Protocol):
    """The content of a form, as plain data.

    A form that may be left and resumed (go: try) has `tries = True`; its `unfinished(answers)`, if it has that, returns
    why answers are not complete enough to go on.
    """

    @property
    def name(self) -> str:
        """Return the form's name in the ledger and in `FORMS`."""

    def items(self) -> list[str]:
        """Return the names of the items to answer."""

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""


@dataclass(frozen=True)
class Sliders:
    """Bipolar attributes, each rated on the scale: {attribute: number}.

    `sides` are two or more stimuli that the participant switches between while rating; `tries` marks a form whose
    answers may be tried out (go: try) before they are final. `live` forms stay on the screen while the stimulus is
    felt, and it follows them; `shows_force` draws its force.
    """

    attributes: tuple[Attribute, ...]
    scale: Scale
    sides: tuple[str, ...] = ()
    tries: bool = False
    live: bool = False
    shows_force: bool = False

    @property
    def name(self) -> str:
        """Return the form's name in the ledger."""
        return "similarity" if self.sides else "authoring" if self.tries else "sliders"

    def items(self) -> list[str]:
        """Return the attributes' names."""
        return [attribute.name for attribute in self.attributes]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
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
        """Return the words in the order shown."""
        return list(self.words)

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
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
    """Words that participants write themselves, at least `at_least` of them: {words: [word, ...]}."""

    at_least: int = 1
    name: str = "lexicon"

    def items(self) -> list[str]:
        """Return the name of the only item."""
        return ["words"]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
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
        """Return the items' names."""
        return [item.name for item in self.questionnaire.items]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        points = self.questionnaire.points
        for name, answer in answers.items():
            if type(answer) is not int or not 1 <= answer <= points:
                return f"{name} = {answer!r}: a whole number from 1 to {points} is expected"
        return None


@dataclass(frozen=True)
class Question:
    """A question about the participant; `levels` are (value, label) pairs, low and high bound a number."""

    name: str
    text: str
    kind: Literal["number", "choice", "text"]
    levels: tuple[tuple[str, str], ...] = ()
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    optional: bool = True

    def problem(self, answer: Any) -> str | None:
        """Return why the answer is not valid, or None; null is valid where the question is optional."""
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
        """Return the questions' names."""
        return [question.name for question in self.questions]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        return next(filter(None, (question.problem(answers[question.name]) for question in self.questions)), None)


@dataclass(frozen=True)
class Consent:
    """The consent text and its answer: {agreed: true or false}. A participant who declines takes no part."""

    text: str
    name: Literal["consent"] = "consent"

    def items(self) -> list[str]:
        """Return the name of the only item."""
        return ["agreed"]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        good = isinstance(answers, Mapping) and set(answers) == {"agreed"} and type(answers["agreed"]) is bool
        return None if good else f"agreed: true or false expected, found {answers!r:.80}"


@dataclass(frozen=True)
class Interview:
    """Questions with free-text answers, which may be empty: {question: text}."""

    questions: tuple[Item, ...]
    name: Literal["interview"] = "interview"

    def items(self) -> list[str]:
        """Return the questions' names."""
        return [question.name for question in self.questions]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        for name, answer in answers.items():
            if not isinstance(answer, str) or len(answer) > LONGEST_WORD * MOST_WORDS:
                return f"{name} = {answer!r:.80}: a text is expected"
        return None


@dataclass(frozen=True)
class Eligibility:
    """Questions that decide whether the person can take part: {eligible: true or false}.

    Only the outcome leaves the screen; the answers to the single questions are private.
    """

    criteria: tuple[Criterion, ...]
    name: Literal["eligibility"] = "eligibility"

    def items(self) -> list[str]:
        """Return the name of the only item."""
        return ["eligible"]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        good = isinstance(answers, Mapping) and set(answers) == {"eligible"} and type(answers["eligible"]) is bool
        return None if good else f"eligible: true or false expected, found {answers!r:.80}"


@dataclass(frozen=True)
class AnchorForm:
    """A reference stimulus, the one with `number` of `of` before its block: {felt: how often it was felt}.

    It is felt as often as the participant wants (go: try), at least once. `wish` is the complete setting that it is
    made from.
    """

    anchor: Anchor
    block: str
    number: int
    of: int
    wish: Mapping[str, float] | None = None
    tries: Literal[True] = True
    name: Literal["anchor"] = "anchor"

    def items(self) -> list[str]:
        """Return the name of the only item."""
        return ["felt"]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        good = isinstance(answers, Mapping) and set(answers) == {"felt"} and type(answers["felt"]) is int
        return None if good and answers["felt"] >= 0 else f"felt: a whole number expected, found {answers!r:.80}"

    def unfinished(self, answers: Mapping[str, Any]) -> str | None:
        """Return why these answers are not complete enough to go on, or None."""
        return "the reference was not felt yet" if answers == {"felt": 0} else None

    def describe(self) -> dict[str, Any]:
        """Return what the ledger stores of the reference beside its stimulus."""
        place = {"number": self.number, "of": self.of, "block": self.block}
        return {**place, **self.anchor.model_dump(mode="json", exclude_none=True)}


@dataclass(frozen=True)
class OwnColumn:
    """A column of an `OwnTable`, and its meaning; `key` columns and the number of the reply identify a row."""

    name: str
    description: str
    kind: Literal["text", "number", "whole", "truth"] = "text"
    unit: str = ""
    key: bool = False


@dataclass(frozen=True)
class OwnTable:
    """A collected table of the answers of one form, which are numbers by item.

    `rows` makes the rows of a form answered in a trial, from the form, the answers, the whole reply, and the request
    as it is stored. The participant, the trial, and whether the answer counts are added to each row when sessions are
    collected.
    """

    name: str
    description: str
    columns: tuple[OwnColumn, ...]
    rows: Callable[[Any, Mapping[str, Any], Mapping[str, Any], Mapping[str, Any]], Iterable[dict[str, Any]]]


@dataclass(frozen=True)
class FormKind:
    """A kind of form, by its name in the ledger.

    `doing` is what the console says while the form is answered, with {n} for the number of items. `simulate` returns a
    simulated participant's reply and the seconds that it took, from the participant, the request and the form. `table`
    is the collected table of the answers; None: `responses` for numbers by item in a trial, else `answers`, where
    `answer_kind` is the type of each answer, or refers to its question. `also` is a further table of a form's own.
    `title` names the form in exports; forms without a title are not exported. `timed` screens record samples from the
    time at which they are shown. `any_answers`: in a trial, too, answers need not be numbers. `screen` is the place
    ("module:NAME") of the screen of a form that an extension brings.
    """

    doing: str
    simulate: Callable[..., Any]
    table: Literal["words", "anchors"] | OwnTable | None = None
    answer_kind: Literal["text", "points", "agreed", "by question"] = "text"
    title: str = ""
    timed: bool = False
    also: OwnTable | None = None
    any_answers: bool = False
    screen: str = ""


FIELDS_TABLE = OwnTable(
    "fields",
    "One row for each question of a composite form that was answered in a trial.",
    (
        OwnColumn("question", "The question's name in the study file.", key=True),
        OwnColumn("kind", "The kind of the question: choice, scale, number, text or confidence."),
        OwnColumn("value", "The answer as a text."),
        OwnColumn("number", "The answer, if it is a number.", "number"),
        OwnColumn("response_time_s", "When it was answered, from the form's appearance.", "number", "s"),
    ),
    lazy_function("palpate.protocols.fields:rows"),
)
"""The collected table of composite forms."""

FORMS: Registry[FormKind] = Registry(
    FORM_PLACES,
    kind="forms",
    of="palpate.protocols.forms:FormKind",
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
        "fields": FormKind(
            "answering {n} question(s)",
            lazy_function("palpate.protocols.fields:simulate"),
            table=FIELDS_TABLE,
            any_answers=True,
        ),
        "anchor": FormKind(
            "getting to know a reference", lazy_function("palpate.protocols.answering:feel_reference"), table="anchors"
        ),
    },
)
"""The kinds of forms by their names in the ledger; a task with a module of its own adds one (`FORM`)."""


def table_of(name: Any) -> str | None:
    """Return the table of a form's own answers, by the form's name in a ledger; None if it is unknown or has none.

    None for a form of an extension, too: a ledger can be read where the extension is not there.
    """
    kind = FORMS.get(name) if isinstance(name, str) and not is_own(name) else None
    table = None if kind is None else kind.table
    return table.name if isinstance(table, OwnTable) else table


def has_any_answers(name: Any) -> bool:
    """Return whether answers to the form of this name need not be numbers in a trial, either; so for extensions."""
    if is_own(name):
        return True
    kind = FORMS.get(name) if isinstance(name, str) else None
    return kind is not None and kind.any_answers


def own_tables(forms: Iterable[str] = FORMS) -> Mapping[str, OwnTable]:
    """Return the tables that these forms declare, by name; by default of all, with those of loaded extensions."""
    tables = (table for name in forms for table in own_tables_of(name))
    return {table.name: table for table in tables}


def tables_with(answers: str) -> tuple[OwnTable, ...]:
    """Return all own tables of the form whose answers are in the table of this name, that one first; () if none is."""
    declared = (own_tables_of(form) for form in FORMS)
    return next((tables for tables in declared if tables and tables[0].name == answers), ())


def own_tables_of(form: str) -> tuple[OwnTable, ...]:
    """Return the tables that the form of this name declares.

    Raises ExtensionError if the form belongs to an extension that is not there, or a table of it to no extension by its
    name.
    """
    kind = FORMS.get(form)
    declared = () if kind is None else (kind.table, kind.also)
    tables = tuple(table for table in declared if isinstance(table, OwnTable))
    begins = f"{extension_of(form)}_" if is_own(form) else ""
    for table in tables:
        if not table.name.startswith(begins):
            raise ExtensionError(f"{form}: its table {table.name!r} is to be named {begins}{table.name}")
    return tables


@dataclass(frozen=True)
class LabForms:
    """The forms that a lab shows to every participant: its consent text and its questions about the person."""

    consent: str
    questions: tuple[Question, ...]

    def definition(self) -> dict[str, Any]:
        """Return the forms as JSON data, for the ledger."""
        return {"consent": self.consent, "questions": [asdict(question) for question in self.questions]}

    @classmethod
    def from_definition(cls, data: Mapping[str, Any]) -> LabForms:
        """Return the forms that are stored in a ledger."""
        questions = [
            Question(**{**question, "levels": tuple((value, label) for value, label in question["levels"])})
            for question in data["questions"]
        ]
        return cls(data["consent"], tuple(questions))


def _texts(value: Any) -> bool:
    """Return whether the value is a list of texts, neither too many nor too long."""
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) > MOST_WORDS:
        return False
    return all(isinstance(word, str) and 0 < len(word.strip()) <= LONGEST_WORD for word in value)

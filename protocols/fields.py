"""The composite form: questions of several kinds on one screen, each with a scale and an answer time of its own.

`ask:` of a study declares it. The kinds are choice, scale, number, text and confidence.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Self

from pydantic import AliasChoices, Field, model_validator

from palpate.protocols.events import Ask, Reply
from palpate.protocols.forms import LONGEST_WORD, Question
from palpate.protocols.keyed import normal, uniform
from palpate.protocols.strict import KnownKeys, list_by_kind, problem_at
from palpate.protocols.study import Attribute, Name, Number, Scale, Text, Whole
from palpate.protocols.wording import count

HUNDREDTHS = Scale(low=0, high=100)
"""What simulated people mark scales in: answers on all scales of a study then vary alike."""
MOST_FIELDS, MOST_OPTIONS, LONGEST_TEXT = 12, 12, 2000


class QuestionSpec(KnownKeys):
    """What all questions have: a name for the answer, a text for the screen, and whether it may stay unanswered."""

    kind: str
    name: Name
    text: Text | None = None
    optional: bool = False

    def problem(self, answer: Any) -> str | None:
        """Return why the answer is not valid, or None; null is valid where the question is optional."""
        if answer is None:
            return None if self.optional else f"{self.name} is not answered"
        return self.invalid(answer)

    @property
    def has_row(self) -> bool:
        """Return whether its answers are rows of the table `fields`; those that `choices` has are not."""
        return True

    @property
    def is_about_intervals(self) -> bool:
        """Return whether it asks which of a trial's intervals it was."""
        return False

    def invalid(self, answer: Any) -> str | None:
        """Return why an answer that was given is not valid, or None."""
        raise NotImplementedError

    def simulated(self, share: float) -> Any:
        """Return an answer for a share from 0 to 1 of all that could be answered."""
        raise NotImplementedError


class Choice(QuestionSpec):
    """One of some options, by a press or the number keys; `of: intervals` are those of the task intervals."""

    kind: Literal["choice"]
    options: Annotated[tuple[Text, ...], Field(max_length=MOST_OPTIONS)] = ()
    of: Literal["intervals"] | None = None

    @model_validator(mode="after")
    def _options_or_intervals(self) -> Self:
        if bool(self.options) == (self.of is not None):
            raise ValueError("options: [TEXT, ...] or of: intervals is expected")
        if self.options and len(set(self.options)) < 2:
            raise problem_at(("options",), "two different ones or more are expected")
        if len(set(self.options)) < len(self.options):
            raise problem_at(("options",), "an option appears twice")
        return self

    @property
    def has_row(self) -> bool:
        """Return whether its answers are rows of the table `fields`: not those about intervals."""
        return not self.is_about_intervals

    @property
    def is_about_intervals(self) -> bool:
        """Return whether it asks which of a trial's intervals it was."""
        return self.of is not None

    def invalid(self, answer: Any) -> str | None:
        """Return why an answer that was given is not valid, or None."""
        return Question(self.name, "", "choice", tuple((option, option) for option in self.options)).problem(answer)

    def simulated(self, share: float) -> str:
        """Return an option."""
        return self.options[min(len(self.options) - 1, math.floor(share * len(self.options)))]


class ScaleQuestion(QuestionSpec):
    """A mark on a scale of its own, as in `scale:` of a study; `ends` are the words at its two ends."""

    kind: Literal["scale"]
    scale: Scale
    ends: tuple[Text, Text] | None = None

    @model_validator(mode="before")
    @classmethod
    def _flat(cls, data: Any) -> Any:
        """Let the keys of the scale stand beside the others: {name, kind: scale, from: 1, to: 5, step: 1}."""
        if not isinstance(data, Mapping) or "scale" in data:
            return data
        own = {"kind", "name", "text", "optional", "ends"}
        return {
            **{key: data[key] for key in data if key in own},
            "scale": {k: v for k, v in data.items() if k not in own},
        }

    def invalid(self, answer: Any) -> str | None:
        """Return why an answer that was given is not valid, or None."""
        return None if self.scale.holds(answer) else f"{self.name} = {answer!r:.60} is not on its scale"

    def simulated(self, share: float) -> float:
        """Return a value of the scale."""
        return self.scale.nearest(self.scale.low + share * (self.scale.high - self.scale.low))


class NumberQuestion(QuestionSpec):
    """A number that is typed, within bounds; `above: 0` allows every positive number, as in a free modulus."""

    kind: Literal["number"]
    low: Number | None = Field(default=None, validation_alias=AliasChoices("from", "low"))
    high: Number | None = Field(default=None, validation_alias=AliasChoices("to", "high"))
    above: Number | None = None
    unit: Text | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError(f"from ({self.low}) must be below to ({self.high})")
        if self.above is not None and self.high is not None and self.above >= self.high:
            raise ValueError(f"above ({self.above}) must be below to ({self.high})")
        return self

    def invalid(self, answer: Any) -> str | None:
        """Return why an answer that was given is not valid, or None."""
        if type(answer) in (int, float) and answer - answer != 0:
            return f"{self.name} = {answer!r}: a finite number is expected"
        low, high = (None if bound is None else float(bound) for bound in (self.low, self.high))
        if (problem := Question(self.name, "", "number", low=low, high=high).problem(answer)) is not None:
            return problem
        too_low = self.above is not None and answer <= self.above
        return f"{self.name} = {answer!r}: a number above {self.above:g} is expected" if too_low else None

    def simulated(self, share: float) -> float:
        """Return a number within the bounds, to a hundredth of their range; from 1 to 100 where there are none."""
        bounds = [bound for bound in (self.low, self.above) if bound is not None]
        low = max(bounds, default=1.0 if self.high is None else self.high - 99.0)
        high = low + 99.0 if self.high is None else self.high
        value = float(low + share * (high - low))
        short = round(value, 2 - math.floor(math.log10(high - low)))
        return short if self.invalid(short) is None else value


class TextQuestion(QuestionSpec):
    """Free text, of at most `longest` characters."""

    kind: Literal["text"]
    longest: Annotated[Whole, Field(ge=1, le=LONGEST_TEXT)] = LONGEST_WORD

    def invalid(self, answer: Any) -> str | None:
        """Return why an answer that was given is not valid, or None."""
        good = isinstance(answer, str) and len(answer.strip()) > 0 and len(answer) <= self.longest
        return None if good else f"{self.name} = {answer!r:.80}: a text of 1 to {self.longest} characters is expected"

    def simulated(self, share: float) -> str | None:
        """Return nothing where that is allowed, else a word."""
        return (
            None if self.optional else ("smooth", "rough", "even", "uneven")[math.floor(share * 3.999)][: self.longest]
        )


class Confidence(QuestionSpec):
    """How sure a participant is, from 1 to `points`; `ends` are the words at its two ends."""

    kind: Literal["confidence"]
    points: Annotated[Whole, Field(ge=2, le=11)] = 4
    ends: tuple[Text, Text] | None = None

    @property
    def has_row(self) -> bool:
        """Return whether its answers are rows of the table `fields`: `choices` has them."""
        return False

    def invalid(self, answer: Any) -> str | None:
        """Return why an answer that was given is not valid, or None."""
        good = type(answer) is int and 1 <= answer <= self.points
        return None if good else f"{self.name} = {answer!r:.60}: a whole number from 1 to {self.points} is expected"

    def simulated(self, share: float) -> int:
        """Return a number of points."""
        return min(self.points, 1 + math.floor(share * self.points))


KINDS: Mapping[str, type[QuestionSpec]] = {
    "choice": Choice,
    "scale": ScaleQuestion,
    "number": NumberQuestion,
    "text": TextQuestion,
    "confidence": Confidence,
}


def questions_from(value: Any) -> tuple[QuestionSpec, ...]:
    """Return the questions in a study file, each by the schema of its kind. Raises ValueError."""
    if not isinstance(value, list | tuple) or not 1 <= len(value) <= MOST_FIELDS:
        raise ValueError(f"a list of 1 to {count(MOST_FIELDS, 'question')} is expected, as [{{name, kind, ...}}]")
    questions = list_by_kind(KINDS, value)
    names = [question.name for question in questions]
    for place, name in enumerate(names):
        if name in names[:place]:
            raise problem_at((place, "name"), f"the question {name!r} appears twice")
    return questions


@dataclass(frozen=True)
class Fields:
    """Questions of several kinds: {question: answer, or null where it is optional}.

    `context` says what the form is about as JSON data; the ledger stores it with the request.
    """

    questions: tuple[QuestionSpec, ...]
    context: Mapping[str, Any] = field(default_factory=dict)
    name: str = "fields"

    def items(self) -> list[str]:
        """Return the questions' names."""
        return [question.name for question in self.questions]

    def problem(self, answers: Any) -> str | None:
        """Return why the answers are not valid, or None."""
        if not isinstance(answers, Mapping) or sorted(answers) != sorted(self.items()):
            return f"answers to {self.items()} expected, found {answers!r:.200}"
        return next(filter(None, (question.problem(answers[question.name]) for question in self.questions)), None)


def simulate(person: Any, ask: Ask, form: Fields) -> tuple[Reply, float]:
    """Answer every question; `person` is a simulated participant of the kind `perceiver`.

    A scale, or a number, that has the name of an attribute in the study's simulation is answered by its percept, others
    by chance. The percept of a scale is in hundredths of its length, as in a rating; that of a number is its decimal
    logarithm above 10, and the person's own bias is the modulus. Numbers have two significant digits, as people give
    them.
    """
    return answered(person, ask, {question.name: _answer(person, ask, question) for question in form.questions})


def answered(person: Any, ask: Ask, answers: Mapping[str, Any]) -> tuple[Reply, float]:
    """Return the reply with these answers, one answer time after the other, and its seconds."""
    at_s, clock = {}, 0.0
    for name in answers:
        clock = round(clock + person.seconds(ask, name), 3)
        at_s[name] = clock
    return Reply({"answers": dict(answers), "at_s": at_s, "seconds": clock}), clock


def _answer(person: Any, ask: Ask, question: QuestionSpec) -> Any:
    latents = person.simulation.latents
    if ask.trial is None or question.name not in latents:
        return question.simulated(uniform(*person.moment("field", ask, question.name)))
    latent = person.latent(question.name, ask.trial.stimulus)
    attribute = Attribute(low=question.name, high=question.name)
    if isinstance(question, ScaleQuestion):
        hundredths = person.rating(latent, attribute, HUNDREDTHS, (ask.trial.number, ask.trial.attempt))
        return question.simulated(hundredths / 100.0)
    felt = person.gain(attribute) * latent + person.bias(attribute)
    felt += person.simulation.noise_sd * normal(*person.moment("noise", ask, question.name))
    if isinstance(question, NumberQuestion):
        number = float(f"{10.0 ** (1.0 + felt):.2g}")
        return number if question.invalid(number) is None else question.simulated(0.5)
    return question.simulated(0.5 * (1.0 + math.erf(felt / math.sqrt(2.0))))


def rows(form: Fields, answers: Mapping[str, Any], reply: Mapping[str, Any], _request: Any) -> Iterator[dict[str, Any]]:
    """Yield a row for each answered question; of a form about intervals without those that `choices` has."""
    times = reply.get("at_s", {})
    for question in form.questions:
        answer = answers[question.name]
        if answer is None or (form.name != Fields.name and not question.has_row):
            continue
        numeric = type(answer) in (int, float)
        yield {
            "question": question.name, "kind": question.kind, "value": str(answer),
            "number": float(answer) if numeric else None, "response_time_s": times.get(question.name),
        }  # fmt: skip

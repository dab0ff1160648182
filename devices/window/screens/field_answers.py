"""The answers to a composite form so far: what was chosen, marked or typed, and when each was last changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.devices.window.inputs import Key
from palpate.devices.window.screens.demographics import number_in
from palpate.devices.window.screens.writing import FieldOn
from palpate.protocols.fields import Choice, Confidence, Fields, NumberQuestion, QuestionSpec, TextQuestion


@dataclass
class FieldAnswers:
    """Answers by the number of their question; those of `fields` are typed, None is no answer."""

    form: Fields
    fields: Mapping[int, FieldOn]
    known: dict[int, Any] = field(default_factory=dict)
    at_s: dict[int, float] = field(default_factory=dict)

    def of(self, number: int) -> Any:
        """Return the answer to a question; None where there is none yet, or no number can be read."""
        if number not in self.fields:
            return self.known.get(number)
        text = self.text(number)
        return number_in(text) if isinstance(self.form.questions[number], NumberQuestion) else text or None

    def text(self, number: int) -> str:
        """Return what is typed into the field of a question, without blanks around it; "" if it has no field."""
        return self.fields[number].writing.text.strip() if number in self.fields else ""

    def is_missing(self, number: int) -> bool:
        """Return whether the question needs an answer yet, or another one."""
        answer = self.of(number)
        unread = answer is None and bool(self.text(number))
        return unread or self.form.questions[number].problem(answer) is not None

    def put(self, number: int, answer: Any, now_s: float) -> None:
        """Set an answer, None to take it back, with its time."""
        self.known[number], self.at_s[number] = answer, round(now_s, 3)

    def write(self, number: int, text: str, now_s: float) -> None:
        """Type into a field; what would make the text longer than the question allows is not written."""
        where, question = self.fields[number], self.form.questions[number]
        before = replace(where.writing), where.composed_to
        where.type(text)
        if isinstance(question, TextQuestion) and len(where.writing.text) > question.longest:
            where.writing, where.composed_to = before
        self._note(number, before[0].text, now_s)

    def press_key(self, number: int, event: Key) -> bool:
        """Hand a key to a field, and return whether it had an effect there."""
        before, handled = self.fields[number].writing.text, self.fields[number].key(event)
        self._note(number, before, event.t_s)
        return handled

    def show(self, answers: Mapping[str, Any]) -> None:
        """Fill in answers given elsewhere, by the names of their questions."""
        for number, question in enumerate(self.form.questions):
            if (answer := answers.get(question.name)) is None:
                continue
            self.known[number] = answer
            if number in self.fields:
                writing = self.fields[number].writing
                writing.text = repr(answer) if isinstance(answer, int | float) else str(answer)
                writing.caret = len(writing.text)

    def value(self) -> dict[str, Any]:
        """Return the answers of all questions, and the times of those that were answered here."""
        answers = {question.name: self.of(number) for number, question in enumerate(self.form.questions)}
        names = self.form.items()
        at_s = {names[number]: self.at_s[number] for number in sorted(self.at_s) if answers[names[number]] is not None}
        return {"answers": answers, "at_s": at_s}

    def _note(self, number: int, before: str, now_s: float) -> None:
        """Note the time of a change of a field's text."""
        if self.fields[number].writing.text != before:
            self.at_s[number] = round(now_s, 3)


def count_of(question: QuestionSpec) -> int:
    """Return how many options or points a question has; 0 if it has none."""
    if isinstance(question, Choice):
        return len(question.options)
    return question.points if isinstance(question, Confidence) else 0


def option_of(question: QuestionSpec, index: int) -> Any:
    """Return the answer that is at a place of the options or the points."""
    return question.options[index] if isinstance(question, Choice) else index + 1


def index_of(question: QuestionSpec, answer: Any) -> int:
    """Return the place of an answer among the options or the points."""
    return question.options.index(answer) if isinstance(question, Choice) else int(answer) - 1

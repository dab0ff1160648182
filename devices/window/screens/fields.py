"""The composite form: choices, scales, numbers, texts and confidence, each with the time of its own answer.

A choice that is all that is asked is answered by the press itself; otherwise Next ends the form.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from palpate.devices.window.fields import Writing
from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.demographics import number_in
from palpate.devices.window.screens.elements import Element, Label
from palpate.devices.window.screens.field_buttons import KEYS, OptionButton, large_buttons
from palpate.devices.window.screens.field_cards import PlacedField, cards_of
from palpate.devices.window.screens.field_words import ShownQuestion, expected_number, shown
from palpate.devices.window.screens.frame import STEPS, Frame, fitted, trial_frame
from palpate.devices.window.screens.sliders import Track, keyed, share_of
from palpate.devices.window.screens.targets import Points
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.events import Ask
from palpate.protocols.fields import (
    Asked,
    Choice,
    Confidence,
    Fields,
    NumberQuestion,
    ScaleQuestion,
    TextQuestion,
)

LONE_STEPS = (10.0, 9.0, 8.0, 7.0, 6.4, *STEPS)
SHORTEST = 40
"""A question of more characters is shortened where it is named as missing."""


class FieldsScreen(Base):
    """A form with a card for each question, or with large buttons where one choice is all that is asked."""

    def __init__(self, ask: Ask, form: Fields, page: Page) -> None:
        self.form = form
        self.answers: dict[str, Any] = {}
        self.at_s: dict[str, float] = {}
        self.questions = [self._shown(page, question) for question in form.questions]
        self.lone = len(form.questions) == 1 and isinstance(form.questions[0], Choice)
        frame = self._frame_for(page, ask)
        self._fixed: tuple[Element, ...] = ()
        self._sheets = self._lone_choice(page, frame.body) if self.lone else cards_of(page, self.questions, frame.body)
        super().__init__(frame, len(self._sheets), ask.may_go_back)
        self.fields = {
            place.number: self._field(place, place.field)
            for sheet in self._sheets
            for place in sheet
            if place.field is not None
        }
        self.show(ask.previous or {})
        self.turned()

    # What is on it.

    def _frame_for(self, page: Page, ask: Ask) -> Frame:
        left, right = back_and_next(page)
        if self.lone:
            count = min(KEYS, len(self.questions[0].labels))
            hint = page.texts("choice_hint", keys=f"1 – {count}" if count > 2 else "1, 2")
            return replace(
                trial_frame(page, ask, "fields_prompt", hint, left if ask.may_go_back else (), ()), prompt=""
            )
        hint = page.texts("fields_hint")
        writes = any(isinstance(question, TextQuestion) for question in self.form.questions)
        return trial_frame(page, ask, "fields_prompt", with_hangul(page, hint) if writes else hint, left, right)

    def _lone_choice(self, page: Page, room: Box) -> list[list[PlacedField]]:
        """Return the question above large buttons, both in the middle of the room."""
        question, unit = self.questions[0], page.metrics.unit
        laid = fitted(page, question.text, room.width, room.height // 3, LONE_STEPS, bold=True, even=True)
        apart = unit(10)
        below = Box(room.left, room.top, room.width, room.height - laid.height - apart)
        if (row := large_buttons(page, question.labels, below)) is None:
            for label in question.labels:
                fitted(page, label, room.width // 4, room.height // 3, STEPS, bold=True)
            raise WindowError(f"the options of {question.text!r:.80} do not fit on a screen of {page.metrics}")
        top = room.top + (room.height - laid.height - apart - row.height) // 2
        text = Box(room.left, top, room.width, laid.height)
        self._fixed = (Label("question 0 text", text, laid=laid, align="centre"),)
        buttons = Box(room.left, text.bottom + apart, room.width, row.height)
        return [[PlacedField(0, (), row.placed(page, buttons, "question 0", within=False))]]

    def body(self) -> Iterator[Element]:
        yield from self._fixed
        for place in self._sheets[self.sheet]:
            yield from place.fixed
            if place.number in self.fields:
                field = self.fields[place.number]
                yield field.element(self.focus == field.name)
            for target in place.targets:
                yield self._looks(place, target)

    def _looks(self, place: PlacedField, target: Element) -> Element:
        """Return a target as it looks with the present answer."""
        question = self.form.questions[place.number]
        answer = self.answers.get(question.name)
        match target:
            case OptionButton() if isinstance(question, Choice):
                number = int(target.name.rpartition(" ")[2])
                chosen = answer == question.options[number]
                return replace(target, chosen=chosen, stop=self.lone or self._is_stop(place, target.name))
            case Track() if isinstance(question, ScaleQuestion):
                share = None if answer is None else share_of(question.scale, answer)
                return replace(target, share=share, held=target.name == self.held)
            case Points():
                return replace(target, at=None if answer is None else answer - 1)
        return target

    # What is answered.

    def value(self) -> dict[str, Any]:
        answers = {question.name: self._answer(n) for n, question in enumerate(self.form.questions)}
        at_s = {name: self.at_s[name] for name, answer in answers.items() if answer is not None and name in self.at_s}
        return {"answers": answers, "at_s": at_s}

    def show(self, answers: Mapping[str, Any]) -> None:
        for number, question in enumerate(self.form.questions):
            answer = answers.get(question.name)
            if answer is None:
                continue
            self.answers[question.name] = answer
            if number in self.fields:
                writing = self.fields[number].writing
                writing.text = repr(answer) if isinstance(answer, int | float) else str(answer)
                writing.caret = len(writing.text)

    def missing(self) -> Sequence[Missing]:
        places = [place for place in self._sheets[self.sheet] if self._problem(place.number)]
        return [(self._stop_of(place), self._short(place.number)) for place in places]

    def complain(self, missing: Sequence[Missing], /, key: str = "please_answer") -> None:
        super().complain(missing, key)
        place = next(place for place in self._sheets[self.sheet] if self._problem(place.number))
        question = self.form.questions[place.number]
        field = self.fields.get(place.number)
        if field is not None and field.writing.text.strip() and isinstance(question, NumberQuestion):
            expected = expected_number(self.page, question)
            self.notice = (f"{self._short(place.number)} {expected}", expected)

    def _answer(self, number: int) -> Any:
        question = self.form.questions[number]
        if number not in self.fields:
            return self.answers.get(question.name)
        text = self.fields[number].writing.text.strip()
        return number_in(text) if isinstance(question, NumberQuestion) else text or None

    def _problem(self, number: int) -> bool:
        """Return whether the question has no valid answer yet; a field of which no number can be read has none."""
        answer = self._answer(number)
        unread = answer is None and number in self.fields and bool(self.fields[number].writing.text.strip())
        return unread or self.form.questions[number].problem(answer) is not None

    def _put(self, number: int, answer: Any) -> None:
        """Set an answer, None to take it back, with its time."""
        name = self.form.questions[number].name
        self.answers[name], self.at_s[name] = answer, round(self.now_s, 3)
        self.notice = ()
        if self.lone and answer is not None:
            self.finish()

    # What is done to it.

    def turned(self) -> None:
        """Set the focus to the first question, so that a number can be typed at once."""
        self.focus = None if self.lone else self._stop_of(self._sheets[self.sheet][0])

    def pressed(self, name: str, event: Pressed) -> None:
        if (place := self._place_of(name)) is None:
            return
        question, target = self.form.questions[place.number], place.targets[0] if place.targets else None
        if place.number in self.fields:
            self.fields[place.number].press(event.x, event.y)
        elif isinstance(question, Choice):
            self._choose(place, int(name.rpartition(" ")[2]))
        elif isinstance(target, Points):
            self._choose(place, target.nearest(event.x))
        else:
            self._drag(place, event)

    def dragged(self, name: str, event: Moved | Released) -> None:
        place = self._place_of(name)
        if place is not None and isinstance(self.form.questions[place.number], ScaleQuestion):
            self._drag(place, event)

    def typed(self, name: str | None, text: str, /) -> None:
        place = self._place_of(name)
        if place is not None and place.number in self.fields:
            self._write(place.number, text)
        elif text in _DIGITS:
            self._choose_by_number(place, int(text) - 1)

    def key(self, name: str | None, event: Key, /) -> bool:
        place = self._place_of(name)
        if place is not None and place.number in self.fields:
            if self._key_in_field(place.number, event):
                return True
        elif place is not None and self._key_on(place, name or "", event):
            return True
        if self.lone and event.name in _ARROWS:
            self.move_focus(_ARROWS[event.name], [target.name for target in self._sheets[0][0].targets])
            return True
        if event.name in ("up", "down") and not self.lone:
            self._go_to(place, _ARROWS[event.name])
            return True
        return False

    def _key_on(self, place: PlacedField, name: str, event: Key) -> bool:
        """Handle a key on buttons, round buttons or a line; return whether it had an effect."""
        question = self.form.questions[place.number]
        before = self.answers.get(question.name)
        if event.name == "delete" and question.optional:
            self._put(place.number, None)
        elif isinstance(question, ScaleQuestion):
            if (value := keyed(question.scale, before, event)) is None:
                return False
            self._put(place.number, _nearest(question, value))
        elif event.name == "space" or (event.name == "enter" and self.lone):
            if not isinstance(question, Choice):
                return False
            self._choose(place, int(name.rpartition(" ")[2]))
        elif event.name in ("left", "right", "home", "end") and not self.lone:
            self._step(place, event.name, before)
        else:
            return False
        return True

    def _step(self, place: PlacedField, key: str, before: Any) -> None:
        """Choose the option or the point beside the present one; the first or the last where there is none yet."""
        last = _count(self.form.questions[place.number]) - 1
        at = None if before is None else self._index(place.number, before)
        left = last if at is None else max(0, at - 1)
        right = 0 if at is None else min(last, at + 1)
        number = {"left": left, "right": right, "home": 0, "end": last}[key]
        if number != at:
            self._choose(place, number)

    def _choose(self, place: PlacedField, number: int) -> None:
        """Choose an option or a point; of an optional question the present answer is taken back."""
        question = self.form.questions[place.number]
        answer = question.options[number] if isinstance(question, Choice) else number + 1
        again = question.optional and self.answers.get(question.name) == answer
        if isinstance(question, Choice):
            self.focus = place.targets[number].name
        self._put(place.number, None if again else answer)

    def _choose_by_number(self, place: PlacedField | None, number: int) -> None:
        """Choose by a number key, in the question with the focus or the first open one; then go on to the next one."""
        places = self._sheets[self.sheet]
        if place is None:
            place = next((one for one in places if self._problem(one.number)), None)
        if place is None or not 0 <= number < _count(self.form.questions[place.number]):
            return
        if self.answers.get(self.form.questions[place.number].name) != self._option(place.number, number):
            self._choose(place, number)
        following = [one for one in places if self._answer(one.number) is None and one.number > place.number]
        if following and self.reply is None:
            self.focus, self.by_key = self._stop_of(following[0]), True

    def _drag(self, place: PlacedField, event: Pressed | Moved | Released) -> None:
        question, track = self.form.questions[place.number], place.targets[0]
        if isinstance(question, ScaleQuestion) and isinstance(track, Track):
            scale = question.scale
            self._put(place.number, _nearest(question, scale.low + track.share_at(event.x) * (scale.high - scale.low)))

    def _write(self, number: int, text: str) -> None:
        """Type into a field; what would make the text longer than the question allows is not written."""
        field, question = self.fields[number], self.form.questions[number]
        before = replace(field.writing), field.composed_to
        field.type(text)
        if isinstance(question, TextQuestion) and len(field.writing.text) > question.longest:
            field.writing, field.composed_to = before
        self._note_written(number, before[0].text)

    def _key_in_field(self, number: int, event: Key) -> bool:
        before, handled = self.fields[number].writing.text, self.fields[number].key(event)
        self._note_written(number, before)
        return handled

    def _note_written(self, number: int, before: str) -> None:
        """Note the time of a change of a field's text."""
        if self.fields[number].writing.text != before:
            self.at_s[self.form.questions[number].name] = round(self.now_s, 3)
            self.notice = ()

    def _go_to(self, place: PlacedField | None, by: int) -> None:
        stops = [self._stop_of(one) for one in self._sheets[self.sheet]]
        if place is not None:
            self.focus = self._stop_of(place)
        self.move_focus(by, stops)

    # Where things are.

    def _field(self, place: PlacedField, box: Box) -> FieldOn:
        name, writing = f"question {place.number}", Writing(many_lines=self.questions[place.number].many_lines)
        latin = isinstance(self.form.questions[place.number], NumberQuestion)
        return FieldOn(self.page, f"{name} field", box, place.size, writing, name, hangul_on=not latin)

    def _place_of(self, name: str | None) -> PlacedField | None:
        """Return the question that a target belongs to."""
        if name is None or not name.startswith("question "):
            return None
        number = int(name.split(" ")[1])
        return next((place for place in self._sheets[self.sheet] if place.number == number), None)

    def _stop_of(self, place: PlacedField) -> str:
        """Return the target of a question that the keyboard's focus stops at."""
        if not place.targets:
            return f"question {place.number} field"
        names = [target.name for target in place.targets]
        answer = self.answers.get(self.form.questions[place.number].name)
        if self.focus in names:
            return str(self.focus)
        return names[0 if len(names) == 1 or answer is None else self._index(place.number, answer)]

    def _is_stop(self, place: PlacedField, name: str) -> bool:
        return name == self._stop_of(place)

    def _index(self, number: int, answer: Any) -> int:
        question = self.form.questions[number]
        return question.options.index(answer) if isinstance(question, Choice) else int(answer) - 1

    def _option(self, number: int, index: int) -> Any:
        question = self.form.questions[number]
        return question.options[index] if isinstance(question, Choice) else index + 1

    def _short(self, number: int) -> str:
        text = self.questions[number].text
        return f"“{text}”" if len(text) <= SHORTEST else f"“{text[: SHORTEST - 2].rstrip()} …”"

    def _shown(self, page: Page, question: Asked) -> ShownQuestion:
        """Return a question with its words."""
        return shown(page, question)


_DIGITS = tuple(str(n) for n in range(1, KEYS + 1))
_ARROWS = {"left": -1, "up": -1, "right": 1, "down": 1}


def _count(question: Asked) -> int:
    """Return how many options or points a question has; 0 if it has none."""
    if isinstance(question, Choice):
        return len(question.options)
    return question.points if isinstance(question, Confidence) else 0


def _nearest(question: ScaleQuestion, value: float) -> float:
    return float(question.scale.nearest(value)) + 0.0  # a plain float, and never -0.0

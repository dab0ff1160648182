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
from palpate.devices.window.screens.elements import Element, Label
from palpate.devices.window.screens.field_answers import FieldAnswers, count_of, index_of, option_of
from palpate.devices.window.screens.field_buttons import KEYS, OptionButton, large_buttons
from palpate.devices.window.screens.field_cards import ERASE, PlacedField, cards_of, keys_of
from palpate.devices.window.screens.field_words import ShownQuestion, expected_number, fields_hint, shown
from palpate.devices.window.screens.frame import STEPS, Frame, fitted, trial_frame
from palpate.devices.window.screens.sliders import Track, keyed, share_of
from palpate.devices.window.screens.targets import Points
from palpate.devices.window.screens.writing import FieldOn
from palpate.protocols.events import Ask
from palpate.protocols.fields import Choice, Fields, NumberQuestion, QuestionSpec, ScaleQuestion

LONE_STEPS = (10.0, 9.0, 8.0, 7.0, 6.4, *STEPS)
SHORTEST = 40
"""A question of more characters is shortened where it is named as missing."""
DIGITS = tuple(str(n) for n in range(1, KEYS + 1))
ARROWS = {"left": -1, "up": -1, "right": 1, "down": 1}


class FieldsScreen(Base):
    """A form with a card for each question, or with large buttons where one choice is all that is asked."""

    def __init__(self, ask: Ask, form: Fields, page: Page) -> None:
        self.form = form
        self.questions = [self._shown(page, question) for question in form.questions]
        first = form.questions[0]
        self.lone = len(form.questions) == 1 and isinstance(first, Choice) and not first.optional
        frame = self._frame_for(page, ask)
        self._fixed: tuple[Element, ...] = ()
        self._sheets = self._lone_choice(page, frame.body) if self.lone else cards_of(page, self.questions, frame.body)
        super().__init__(frame, len(self._sheets), ask.may_go_back)
        places = [place for sheet in self._sheets for place in sheet]
        self.fields = {place.number: self._field(place, place.field) for place in places if place.field is not None}
        self.given = FieldAnswers(form, self.fields)
        self.show(ask.previous or {})
        self.turned()

    # What is on it.

    def _shown(self, page: Page, question: QuestionSpec) -> ShownQuestion:
        """Return a question with its words."""
        return shown(page, question)

    def _frame_for(self, page: Page, ask: Ask) -> Frame:
        left, right = back_and_next(page)
        hint = fields_hint(page, self.questions, self.lone)
        if self.lone:
            left = left if ask.may_go_back else ()
            return replace(trial_frame(page, ask, "fields_prompt", hint, left, ()), prompt="")
        return trial_frame(page, ask, "fields_prompt", hint, left, right)

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

    def _field(self, place: PlacedField, box: Box) -> FieldOn:
        name, writing = f"question {place.number}", Writing(many_lines=self.questions[place.number].many_lines)
        latin = isinstance(self.form.questions[place.number], NumberQuestion)
        return FieldOn(self.page, f"{name} field", box, place.size, writing, name, hangul_on=not latin)

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
        question, answer = self.form.questions[place.number], self.given.of(place.number)
        match target:
            case OptionButton() if isinstance(question, NumberQuestion):
                return replace(target, stop=False)
            case OptionButton() if isinstance(question, Choice):
                chosen = answer == question.options[_place_in(target.name)]
                return replace(target, chosen=chosen, stop=self.lone or target.name == self._stop_of(place))
            case Track() if isinstance(question, ScaleQuestion):
                share = None if answer is None else share_of(question.scale, answer)
                return replace(target, share=share, held=target.name == self.held)
            case Points():
                return replace(target, at=None if answer is None else answer - 1)
        return target

    # What is answered.

    def value(self) -> dict[str, Any]:
        return self.given.value()

    def show(self, answers: Mapping[str, Any]) -> None:
        self.given.show(answers)

    def missing(self) -> Sequence[Missing]:
        places = [place for place in self._sheets[self.sheet] if self.given.is_missing(place.number)]
        return [(self._stop_of(place), self._short(place.number)) for place in places]

    def complain(self, missing: Sequence[Missing], /, key: str = "please_answer") -> None:
        """Name what is missing; where a number is typed that is not valid, say which is expected."""
        super().complain(missing, key)
        place = next(place for place in self._sheets[self.sheet] if self.given.is_missing(place.number))
        question = self.form.questions[place.number]
        if self.given.text(place.number) and isinstance(question, NumberQuestion):
            expected = expected_number(self.page, question)
            self.notice = (f"{self._short(place.number)} {expected}", expected)

    def _put(self, number: int, answer: Any) -> None:
        self.given.put(number, answer, self.now_s)
        self.notice = ()
        if self.lone and answer is not None:
            self.finish()

    def _mark(self, place: PlacedField, value: float) -> None:
        """Set a mark to the nearest value of its scale."""
        question = self.form.questions[place.number]
        if isinstance(question, ScaleQuestion):
            self._put(place.number, float(question.scale.nearest(value)) + 0.0)  # a plain float, and never -0.0

    def _choose(self, place: PlacedField, index: int) -> None:
        """Choose an option or a point; of an optional question the present answer is taken back."""
        question = self.form.questions[place.number]
        answer = option_of(question, index)
        if isinstance(question, Choice):
            self.focus = place.targets[index].name
        self._put(place.number, None if question.optional and self.given.of(place.number) == answer else answer)

    # What is done to it.

    def turned(self) -> None:
        """Set the focus to the first question, so that a number can be typed at once."""
        self.focus = None if self.lone else self._stop_of(self._sheets[self.sheet][0])

    def pressed(self, name: str, event: Pressed) -> None:
        if (place := self._place_of(name)) is None:
            return
        if place.number in self.fields:
            if name == f"question {place.number} field":
                self.fields[place.number].press(event.x, event.y)
            else:
                self._press_key_of_pad(place, _place_in(name), event.t_s)
            return
        match place.targets[0]:
            case OptionButton():
                self._choose(place, _place_in(name))
            case Points() as points:
                self._choose(place, points.nearest(event.x))
            case Track() as track:
                self._drag(place, track, event)

    def _press_key_of_pad(self, place: PlacedField, index: int, t_s: float) -> None:
        """Type with a key of a number's pad; the field keeps the focus."""
        question = self.form.questions[place.number]
        key = keys_of(question)[index] if isinstance(question, NumberQuestion) else ""
        if key == ERASE:
            self.given.press_key(place.number, Key("backspace", False, t_s))
        else:
            self.given.write(place.number, key, self.now_s)
        self.focus, self.notice = self._stop_of(place), ()

    def dragged(self, name: str, event: Moved | Released) -> None:
        place = self._place_of(name)
        if place is not None and place.targets and isinstance(track := place.targets[0], Track):
            self._drag(place, track, event)

    def _drag(self, place: PlacedField, track: Track, event: Pressed | Moved | Released) -> None:
        question = self.form.questions[place.number]
        if isinstance(question, ScaleQuestion):
            scale = question.scale
            self._mark(place, scale.low + track.share_at(event.x) * (scale.high - scale.low))

    def typed(self, name: str | None, text: str, /) -> None:
        place = self._place_of(name)
        if place is not None and place.number in self.fields:
            self.given.write(place.number, text, self.now_s)
            self.notice = ()
        elif text in DIGITS:
            self._choose_by_number(place, int(text) - 1)

    def key(self, name: str | None, event: Key, /) -> bool:
        place, by = self._place_of(name), ARROWS.get(event.name)
        if place is not None and self._key_on(place, name or "", event):
            return True
        if by is not None and self.lone:
            self.move_focus(by, [target.name for target in self._sheets[0][0].targets])
        elif by is not None and event.name in ("up", "down"):
            if place is not None:
                self.focus = self._stop_of(place)
            self.move_focus(by, [self._stop_of(one) for one in self._sheets[self.sheet]])
        else:
            return False
        return True

    def _key_on(self, place: PlacedField, name: str, event: Key) -> bool:
        """Handle a key on what answers a question; return whether it had an effect there."""
        number, question = place.number, self.form.questions[place.number]
        if number in self.fields:
            self.notice = ()
            return self.given.press_key(number, event)
        before = self.given.of(number)
        if event.name == "delete" and question.optional:
            self._put(number, None)
        elif isinstance(question, ScaleQuestion):
            if (value := keyed(question.scale, before, event)) is None:
                return False
            self._mark(place, value)
        elif isinstance(question, Choice) and (event.name == "space" or (event.name == "enter" and self.lone)):
            self._choose(place, _place_in(name))
        elif event.name in ("left", "right", "home", "end") and not self.lone:
            self._step(place, event.name, before)
        else:
            return False
        return True

    def _step(self, place: PlacedField, key: str, before: Any) -> None:
        """Choose the option or the point beside the present one; the first or the last where there is none yet."""
        question = self.form.questions[place.number]
        last, at = count_of(question) - 1, None if before is None else index_of(question, before)
        left, right = (last, 0) if at is None else (max(0, at - 1), min(last, at + 1))
        index = {"left": left, "right": right, "home": 0, "end": last}[key]
        if index != at:
            self._choose(place, index)

    def _choose_by_number(self, place: PlacedField | None, index: int) -> None:
        """Choose by a number key, in the question with the focus or the first open one; then go on to the next one."""
        places = self._sheets[self.sheet]
        if place is None:
            place = next((one for one in places if self.given.is_missing(one.number)), None)
        if place is None or not 0 <= index < count_of(self.form.questions[place.number]):
            return
        if self.given.of(place.number) != option_of(self.form.questions[place.number], index):
            self._choose(place, index)
        following = [one for one in places if one.number > place.number and self.given.of(one.number) is None]
        if following and self.reply is None:
            self.focus, self.by_key = self._stop_of(following[0]), True

    # Where things are.

    def _place_of(self, name: str | None) -> PlacedField | None:
        """Return the question that a target belongs to."""
        if name is None or not name.startswith("question "):
            return None
        number = int(name.split(" ")[1])
        return next((place for place in self._sheets[self.sheet] if place.number == number), None)

    def _stop_of(self, place: PlacedField) -> str:
        """Return the target of a question that the keyboard's focus stops at."""
        if place.number in self.fields:
            return f"question {place.number} field"
        names = [target.name for target in place.targets]
        if self.focus in names:
            return str(self.focus)
        answer = self.given.of(place.number)
        return names[0 if len(names) == 1 or answer is None else index_of(self.form.questions[place.number], answer)]

    def _short(self, number: int) -> str:
        text = self.questions[number].text
        return f"“{text}”" if len(text) <= SHORTEST else f"“{text[: SHORTEST - 2].rstrip()} …”"


def _place_in(name: str) -> int:
    """Return the place of an option's button in its row."""
    return int(name.rpartition(" ")[2])

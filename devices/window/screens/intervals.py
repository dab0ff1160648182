"""The form after intervals: which of them it was, with the words of the study or of the screens."""

from __future__ import annotations

from palpate.devices.window.screen import Page
from palpate.devices.window.screens.field_words import ShownQuestion
from palpate.devices.window.screens.fields import FieldsScreen
from palpate.devices.window.screens.specimens import Specimen, Wording
from palpate.protocols.events import Ask
from palpate.protocols.fields import Choice, Confidence, QuestionSpec
from palpate.protocols.intervals import Intervals
from palpate.protocols.study import Stimulus
from palpate.protocols.tasks.intervals import IntervalsForm
from palpate.protocols.trial import Trial

QUESTIONS = {
    "forced_choice": "which_interval",
    "yes_no": "was_it_there",
    "same_different": "same_or_different",
    "oddity": "which_differs",
}


class IntervalsScreen(FieldsScreen):
    """The composite form with the question of the intervals; an answer stays the interval's number, or yes, or same."""

    form: IntervalsForm

    def _shown(self, page: Page, question: QuestionSpec) -> ShownQuestion:
        if not isinstance(question, Choice) or question.of is None:
            return super()._shown(page, question)
        intervals = self.form.intervals
        text = page.say(question.text) if question.text else page.texts(QUESTIONS[intervals.design])
        return ShownQuestion(question, text, _names(page, intervals))


def _names(page: Page, intervals: Intervals) -> tuple[str, ...]:
    """Return the labels of the answers: the study's names, or left and right, first and second, yes and no, ...."""
    if intervals.names:
        return tuple(map(page.say, intervals.names))
    sides = {"1": "left", "2": "right"} if intervals.at_once and intervals.of == 2 else {}
    keys = (f"ordinal_{answer}" if answer.isdecimal() else answer for answer in intervals.answers)
    return tuple(page.texts(sides.get(answer, key)) for answer, key in zip(intervals.answers, keys, strict=True))


SCREEN = IntervalsScreen


def SPECIMEN(words: Wording) -> Specimen:
    """Return a specimen of two intervals, of which one is chosen, and of how sure the participant is."""
    return specimen_of(Intervals(), words.fields[0][0], sure=True)


def specimen_of(intervals: Intervals, text: str | None = None, sure: bool = False) -> Specimen:
    """Return a specimen of a design, with its choice alone or with confidence below it."""
    options = {"options": intervals.answers}
    choice = Choice(kind="choice", name="chosen", of="intervals", text=text).model_copy(update=options)
    confidence = (Confidence(kind="confidence", name="sure"),) if sure else ()
    form = IntervalsForm((choice, *confidence), intervals=intervals)
    trial = Trial(15, "1", False, Stimulus(id="1"), form, may_go_back=False, rest_before=False)
    return Specimen(Ask(form, trial), {"chosen": intervals.answers[0]} if sure else {})

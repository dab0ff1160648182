"""The words of a question of the composite form: those of the study, or of the screens where the study has none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palpate.devices.window.screen import Page
from palpate.devices.window.screens.field_buttons import KEYS
from palpate.devices.window.screens.writing import with_hangul
from palpate.protocols.fields import Choice, Confidence, NumberQuestion, QuestionSpec, ScaleQuestion, TextQuestion

ONE_LINE = 60
"""A text of at most so many characters is written on one line."""


@dataclass(frozen=True)
class ShownQuestion:
    """A question with its words in the participant's language: of options, of the two ends, of a unit."""

    asked: QuestionSpec
    text: str
    labels: tuple[str, ...] = ()
    ends: tuple[str, str] = ("", "")
    unit: str = ""

    @property
    def many_lines(self) -> bool:
        """Return whether the field has several lines."""
        return isinstance(self.asked, TextQuestion) and self.asked.longest > ONE_LINE


def shown(page: Page, question: QuestionSpec) -> ShownQuestion:
    """Return a question with its words; without a text it shows its name, or asks how sure the participant is."""
    default = page.texts("how_sure") if isinstance(question, Confidence) else question.name.replace("_", " ")
    text = page.say(question.text) if question.text else default
    match question:
        case Choice():
            return ShownQuestion(question, text, tuple(map(page.say, question.options)))
        case Confidence():
            return ShownQuestion(question, text, ends=_ends(page, question.ends) or _sure(page))
        case ScaleQuestion():
            scale = question.scale
            numbers = ("", "") if scale.labels else (f"{scale.low:g}", f"{scale.high:g}")
            return ShownQuestion(question, text, ends=_ends(page, question.ends) or numbers)
        case NumberQuestion():
            return ShownQuestion(question, text, unit=page.say(question.unit) if question.unit else "")
    return ShownQuestion(question, text)


def fields_hint(page: Page, questions: Sequence[ShownQuestion], lone: bool) -> str:
    """Return which keys answer the form; `lone`: one choice is all that is asked."""
    if lone:
        count = min(KEYS, len(questions[0].labels))
        return page.texts("choice_hint", keys=f"1 – {count}" if count > 2 else "1, 2")
    keys = ["fields_hint"]
    if any(isinstance(question.asked, Choice | Confidence) for question in questions):
        keys.append("fields_number_hint")
    elif any(isinstance(question.asked, ScaleQuestion) for question in questions):
        keys.append("fields_line_hint")
    if any(question.many_lines for question in questions):
        keys.append("fields_text_hint")
    hint = "   ".join(map(page.texts, keys))
    writes = any(isinstance(question.asked, TextQuestion) for question in questions)
    return with_hangul(page, hint) if writes else hint


def expected_number(page: Page, question: NumberQuestion) -> str:
    """Return what kind of number is expected, in the participant's language."""
    low, high = (None if bound is None else f"{bound:g}" for bound in (question.low, question.high))
    if question.above is not None and (low is None or question.above >= float(low)):
        return page.texts("number_above", low=f"{question.above:g}")
    keys = {(True, True): "number_range", (True, False): "number_least", (False, True): "number_most"}
    return page.texts(keys.get((low is not None, high is not None), "number_any")).format(low=low, high=high)


def _ends(page: Page, ends: tuple[str, str] | None) -> tuple[str, str] | None:
    return None if ends is None else (page.say(ends[0]), page.say(ends[1]))


def _sure(page: Page) -> tuple[str, str]:
    return page.texts("sure_low"), page.texts("sure_high")

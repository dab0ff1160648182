"""Build the screen for a request, and the pages between requests."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import cast

from palpate.devices.window.screen import Page, Screen
from palpate.devices.window.screens.pages import MessageScreen, RestScreen, RulerScreen
from palpate.devices.window.screens.reading import InstructionScreen
from palpate.devices.window.screens.signs import INTERVAL, RIGHT, WRONG, FeedbackScreen, IntervalScreen
from palpate.protocols.events import Ask, Confirm, Instruct, Present, Rest
from palpate.protocols.forms import FORMS, Form, Sliders
from palpate.protocols.registry import load_object, place_in

__all__ = ["Page", "demand_shown", "page_for", "screen_for"]


_SCREENS = "palpate.devices.window.screens"
SCREEN_PLACES: Mapping[str, str] = {
    "sliders": f"{_SCREENS}.sliders:SliderScreen",
    "similarity": f"{_SCREENS}.similarity:SimilarityScreen",
    "authoring": f"{_SCREENS}.authoring:AuthoringScreen",
    "adjectives": f"{_SCREENS}.words:WordScreen",
    "lexicon": f"{_SCREENS}.lexicon:LexiconScreen",
    "suggestions": f"{_SCREENS}.lexicon:LexiconScreen",
    "likert": f"{_SCREENS}.likert:LikertScreen",
    "demographics": f"{_SCREENS}.demographics:DemographicsScreen",
    "eligibility": f"{_SCREENS}.demographics:EligibilityScreen",
    "consent": f"{_SCREENS}.reading:ConsentScreen",
    "interview": f"{_SCREENS}.interview:InterviewScreen",
    "anchor": f"{_SCREENS}.anchor:AnchorScreen",
    "fields": f"{_SCREENS}.fields:FieldsScreen",
}
"""The screens of forms, by the forms' names. A form that is not listed has `SCREEN` in a module of its own."""
RESTING = "resting"
"""The page of a rest that the participant requested."""


def screen_for(request: Ask | Instruct | Rest | Confirm | Present, page: Page, t0_ns: int) -> Screen:
    """Return a new screen with the earlier answers filled in; its samples count from t0_ns, when it is shown.

    Raises WindowError if it cannot be shown: a text that does not fit, a line wider than the screen.
    """
    match request:
        case Ask():
            return _form(request, page, t0_ns)
        case Present():
            if (form := request.live_form) is None:
                return MessageScreen("feel_now", page)
            return _live(Ask(form, request.trial, request.wish), form, page, t0_ns, playing=True)
        case Instruct():
            return InstructionScreen(request, page)
        case Rest():
            return RestScreen(request, page)
        case Confirm():
            return RulerScreen(page) if request.text is None else MessageScreen("pause", page)


def page_for(key: str, page: Page) -> Screen:
    """Return a page by its key: changing_sample, feel_now, recording, pause, end, ...; RESTING; interval 1, ....

    Only the page of a rest has an answer: the participant goes on. Raises WindowError for an unknown key.
    """
    if key == RESTING:
        return RestScreen(None, page)
    if key in (RIGHT, WRONG):
        return FeedbackScreen(key, page)
    number = key.removeprefix(INTERVAL)
    return IntervalScreen(number, page) if number != key and number.isdecimal() else MessageScreen(key, page)


def demand_shown(forms: Iterable[Form], page: Page) -> None:
    """Raise WindowError unless every form and every page of text can be shown, before a session begins."""
    requests: list[Ask | Instruct] = [*map(Ask, forms), *map(Instruct, page.pages)]
    for request in requests:
        screen_for(request, page, 0).scene()
        if isinstance(request, Ask) and isinstance(request.form, Sliders) and request.form.live:
            _live(request, request.form, page, 0, playing=True).scene()
    for key in (RIGHT, WRONG):
        page_for(key, page).scene()


def _form(ask: Ask, page: Page, t0_ns: int) -> Screen:
    if isinstance(ask.form, Sliders) and ask.form.live:
        return _live(ask, ask.form, page, t0_ns, playing=False)
    name = ask.form.name
    make = load_object(FORMS[name].screen or SCREEN_PLACES.get(name) or place_in(_SCREENS, name, "SCREEN"))
    return cast(Screen, make(ask, ask.form, page, *((t0_ns,) if FORMS[name].timed else ())))


def _live(ask: Ask, form: Sliders, page: Page, t0_ns: int, playing: bool) -> Screen:
    from palpate.devices.window.screens.live_authoring import LiveAuthoringScreen

    return LiveAuthoringScreen(ask, form, page, t0_ns, playing)

"""Pages without an answer, or where the only answer is to go on: rest, waiting, pause, the end, the ruler."""

from __future__ import annotations

from collections.abc import Iterator

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.paint import QUIET
from palpate.devices.window.paint_text import Laid
from palpate.devices.window.screen import SLIDER_MM, Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Card, Element, Label, Progress, Ruler, rounding
from palpate.devices.window.screens.frame import Choice, Frame, fitted
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.events import Rest

TITLE_STEPS = (10.0, 9.0, 8.0, 7.0, 6.0, 5.0)
TEXT_STEPS = (6.6, 6.0, 5.4, 5.0, 4.6, 4.2)
WIDEST = 190.0


class MessageScreen(Base):
    """A page by its text key: a title and a text, or a text alone. It has no answer."""

    def __init__(self, key: str, page: Page) -> None:
        super().__init__(Frame(page, "", "", (), ()))
        self._elements_once = tuple(_message(page, *_words(page, key)))

    def body(self) -> Iterator[Element]:
        yield from self._elements_once

    def default_choice(self) -> str | None:
        return None


class RestScreen(Base):
    """A break, with the progress of the session if it was planned."""

    def __init__(self, request: Rest | None, page: Page) -> None:
        right = (Choice("next", page.texts("continue"), primary=True),)
        super().__init__(Frame(page, "", "", (), right))
        words, done = (page.texts("rest_title"), page.texts("rest_text")), None
        if request is not None:
            share = request.done / max(1, request.total)
            done = share, page.texts("rest_progress", done=request.done, total=request.total)
        self._elements_once = tuple(_message(page, *words, done=done))

    def body(self) -> Iterator[Element]:
        yield from self._elements_once


class RulerScreen(Base):
    """A line of an exact length for the experimenter's ruler; the reading is typed at the desk."""

    def __init__(self, page: Page, nominal_mm: float = SLIDER_MM) -> None:
        super().__init__(Frame(page, page.texts("calibration_title"), "", (), ()))
        self.nominal_mm = nominal_mm
        self._elements_once = tuple(self._line())

    def body(self) -> Iterator[Element]:
        yield from self._elements_once

    def default_choice(self) -> str | None:
        return None

    def _line(self) -> Iterator[Element]:
        page, room, unit = self.page, self.frame.body, self.page.metrics.unit
        length = page.metrics.mm(self.nominal_mm)
        if length > room.width:
            raise WindowError(f"a line of {self.nominal_mm:g} mm is wider than the screen of {page.metrics}")
        text = page.texts("calibration_text", nominal=f"{self.nominal_mm:g}")
        width = min(room.width, unit(WIDEST))
        laid = fitted(page, text, width, room.height // 3, TEXT_STEPS)
        left = (page.metrics.width_px - length) // 2
        line = Box(left, room.top + room.height // 2 - unit(20), length, unit(16))
        card = Box(left - unit(14), line.top - unit(12), length + 2 * unit(14), line.height + 2 * unit(12))
        yield Card("card", card, radius=rounding(page))
        yield Ruler("ruler", line, "card")
        place = Box((page.metrics.width_px - width) // 2, card.bottom + unit(8), width, laid.height)
        yield Label("text", place, laid=laid, colour=QUIET, align="centre")


def _words(page: Page, key: str) -> tuple[str, str]:
    """Return (title, text) of a page's key. Raises WindowError for an unknown key."""
    words = page.texts.words
    for name in (key, f"{key}_text"):
        if name in words:
            return words.get(f"{key}_title", ""), words[name]
    raise WindowError(f"no page {key!r} among the texts of the screens; {nearest(key, words)}")


def _message(page: Page, title: str, text: str, done: tuple[float, str] | None = None) -> Iterator[Element]:
    """Yield title, text and progress below one another in the middle of the screen."""
    unit, metrics = page.metrics.unit, page.metrics
    width = min(metrics.width_px - 2 * unit(16), unit(WIDEST))
    left, room = (metrics.width_px - width) // 2, metrics.height_px // 3
    laid = [
        ("title", fitted(page, title, width, room, TITLE_STEPS, bold=True) if title else None),
        ("text", fitted(page, text, width, room, TEXT_STEPS if title else TITLE_STEPS[3:], even=True)),
        ("done", fitted(page, done[1], width, room, TEXT_STEPS[2:]) if done else None),
    ]
    parts = [(name, part) for name, part in laid if part is not None]
    bar = unit(5) + 2 * unit(4) if done else 0
    height = sum(part.height for _, part in parts) + unit(4) * (len(parts) - 1) + bar
    top = (metrics.height_px - unit(10) - height) // 2
    for name, part in parts:
        if name == "done" and done:
            yield Progress("bar", Box(left + width // 6, top + unit(4), 2 * width // 3, unit(5)), share=done[0])
            top += bar
        yield _line(name, part, Box(left, top, width, part.height))
        top += part.height + unit(4)


def _line(name: str, laid: Laid, box: Box) -> Label:
    return (
        Label(name, box, laid=laid, align="centre") if name == "title" else Label(name, box, "", laid, QUIET, "centre")
    )

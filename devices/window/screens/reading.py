"""Text to read, on as many pages as needed: instructions and consent."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.inputs import Key
from palpate.devices.window.paint_text import Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.elements import Element, Label
from palpate.devices.window.screens.frame import Choice, Frame, fitted
from palpate.devices.window.screens.targets import Button
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.events import Ask, Instruct
from palpate.protocols.forms import Consent

WIDEST = 205.0
"""Longest line, in the design's millimetres: about 75 letters, beyond which readers lose the next line."""
BETWEEN = 0.6
"""Room between paragraphs, in lines."""
STEPS = (6.2, 5.8, 5.4, 5.0)
"""Sizes tried to fit a text on one page; a longer text has several pages at the last size."""
LONELY = 8
"""A last line of so few letters is avoided."""
_MARKS = re.compile(r"\*\*|(?<!_)__(?!_)|<!--.*?-->", re.DOTALL)
_ITEM = re.compile(r"^\s*(?:[-*•]|\d+[.)])\s+")


@dataclass(frozen=True)
class Paragraph:
    """A paragraph, a heading or an item of a list."""

    text: str
    heading: bool = False


class InstructionScreen(Base):
    """A page of instructions, by its name, read to its end. Raises WindowError for an unknown page."""

    def __init__(self, request: Instruct, page: Page) -> None:
        if request.page not in page.pages:
            raise WindowError(f"no text for the page {request.page!r}; {nearest(request.page, page.pages)}")
        text = page.say(page.pages[request.page])
        left, right = (Choice("back", page.texts("back")),), (Choice("next", page.texts("next"), primary=True),)
        frame = Frame(page, page.texts("instructions_title"), page.texts("page_hint"), left, right)
        self._pages = paged(page, text, frame.body)
        super().__init__(frame, len(self._pages))

    def body(self) -> Iterator[Element]:
        yield from self._pages[self.sheet]


class ConsentScreen(Base):
    """The consent text: agreeing is possible on its last page, declining on every page."""

    def __init__(self, ask: Ask, form: Consent, page: Page) -> None:
        texts = page.texts
        left = (Choice("back", texts("back")),)
        decline = Choice("decline", texts("decline"))
        self._turning = (decline, Choice("next", texts("next"), primary=True))
        self._deciding = (decline, Choice("agree", texts("agree"), primary=True))
        frame = Frame(page, texts("consent_title"), "", left, self._turning)
        self._pages = paged(page, page.say(form.text), frame.body)
        super().__init__(frame, len(self._pages))
        self.agreed: bool | None = (ask.previous or {}).get("agreed")
        self.turned()

    def body(self) -> Iterator[Element]:
        yield from self._pages[self.sheet]

    def turned(self) -> None:
        last = self.sheet == self.sheets - 1
        self.frame = replace(self.frame, right=self._deciding if last else self._turning)
        if last:
            self.wait_a_moment()

    def buttons(self) -> Iterator[Button]:
        chosen = {True: "agree", False: "decline", None: ""}[self.agreed]
        for button in super().buttons():
            yield replace(button, chosen=True, primary=False) if button.name == chosen else button

    def chosen(self, name: str) -> None:
        self.agreed = name == "agree"
        self.finish()

    def value(self) -> dict[str, Any]:
        return {"answers": {"agreed": self.agreed}}

    def key(self, name: str | None, event: Key) -> bool:
        """Return whether to swallow the key: on the last page, Enter agrees only if a button has the focus."""
        on_button = name in ("next", "agree", "decline", "back")
        return event.name == "enter" and not on_button and self.sheet == self.sheets - 1

    def show(self, answers: Mapping[str, Any]) -> None:
        self.agreed, self.sheet = answers.get("agreed"), self.sheets - 1
        self.turned()


def paragraphs(text: str) -> list[Paragraph]:
    """Split the text into paragraphs at blank lines; list items stay on their own lines, and # begins a heading."""
    parts = []
    for block in re.split(r"\n\s*\n", _MARKS.sub("", text)):
        lines: list[str] = []
        for line in block.strip().splitlines():
            if lines and not _ITEM.match(line) and not line.startswith("#"):
                lines[-1] += " " + line.strip()
            else:
                lines.append(line.strip())
        parts += [_paragraph(line) for line in lines if line]
    return parts


def paged(page: Page, text: str, room: Box) -> list[list[Element]]:
    """Return the text on one page at the largest possible size, or else on several pages.

    Raises WindowError if a word is wider than a page, or if there is no text.
    """
    width = min(room.width, page.metrics.unit(WIDEST))
    column = Box(room.left + (room.width - width) // 2, room.top, width, room.height)
    if not (parts := paragraphs(text)):
        raise WindowError(f"a text of the study or the lab has no words to read: {text!r:.80}")
    for step in STEPS:
        laid = [_laid(page, part, column.width, step) for part in parts]
        between = sum(round(BETWEEN * part.leading) for part in laid[:-1])
        if (spare := column.height - sum(part.height for part in laid) - between) >= 0:
            return _filled(laid, Box(column.left, column.top + spare // 4, column.width, column.height - spare // 4))
    return _filled(laid, column)


def _paragraph(line: str) -> Paragraph:
    if line.startswith("#"):
        return Paragraph(line.lstrip("#").strip(), heading=True)
    return Paragraph(re.sub(r"^[-*]\s+", "•  ", line))


def _laid(page: Page, part: Paragraph, width: int, step: float) -> Laid:
    sizes = tuple(size for size in (step, *STEPS, 4.2) if size <= step)
    laid = fitted(page, part.text, width, None, sizes, bold=part.heading)
    for narrower in (0.97, 0.94, 0.91, 0.88):
        if len(laid.lines) < 2 or len(laid.lines[-1]) > LONELY:
            break
        other = lay(page.fonts, part.text, laid.size, round(narrower * width), bold=part.heading)
        laid = other if other is not None and len(other.lines) == len(laid.lines) else laid
    return laid


def _filled(parts: list[Laid], column: Box) -> list[list[Element]]:
    """Fill pages with paragraphs, broken between lines where needed."""
    pages: list[list[Element]] = [[]]
    top = column.top
    for part in parts:
        rest = part
        while rest.lines:
            fitting = max(0, (column.bottom - top) // rest.leading)
            if fitting < min(2, len(rest.lines)) and pages[-1]:
                pages.append([])
                top = column.top
                continue
            now = replace(rest, lines=rest.lines[: max(1, fitting)])
            rest = replace(rest, lines=rest.lines[max(1, fitting) :])
            box = Box(column.left, top, column.width, now.height)
            pages[-1].append(Label(f"text {len(pages)}.{len(pages[-1])}", box, laid=now))
            top = box.bottom + round(BETWEEN * part.leading)
    return pages

"""Pages besides the sliders: enter a name, choose a design, read help, recover work."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from palpate.devices.author.designs import LONGEST_NAME, name_problem
from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key, Pressed
from palpate.devices.window.paint_text import LEADING
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base
from palpate.devices.window.screens.cards import dealt
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import HINT_STEPS, Choice, Frame, fitted
from palpate.devices.window.screens.reading import paged
from palpate.devices.window.screens.targets import Button
from palpate.devices.window.screens.writing import FieldOn, with_hangul
from palpate.protocols.events import Reply

NAME = "name"
ROWS = 8
"""Number of designs on one page."""


class Aside(Base):
    """A page that leads back to the sliders; its reply's value is the result."""

    def value(self) -> dict[str, Any]:
        return {}

    def leave(self) -> None:
        """Go back without a result."""
        self.reply = Reply({"left": True})

    def chosen(self, _name: str, /) -> None:
        self.leave()

    def go_back(self) -> None:
        if self.sheet > 0:
            super().go_back()
        else:
            self.leave()


class NameScreen(Aside):
    """The page for the name of a design; a name that exists has to be confirmed."""

    def __init__(self, page: Page, prompt: str, name: str, taken: Callable[[str], bool]) -> None:
        texts = page.texts
        left = (Choice("leave", texts("cancel")),)
        hint = with_hangul(page, texts("name_hint"))
        frame = Frame(page, texts(prompt), hint, left, (Choice("next", texts("save"), primary=True),))
        self._taken, self._warned = taken, ""
        # A field of one line, in the upper part of the room.
        unit = page.metrics.unit
        size = page.metrics.text(5.4)
        width, height = min(frame.body.width, unit(170)), round(LEADING * size) + 2 * unit(2)
        box = Box(
            frame.body.left + (frame.body.width - width) // 2, frame.body.top + frame.body.height // 4, width, height
        )
        self.field = FieldOn(page, NAME, box, size)
        self.field.writing.insert(name)
        super().__init__(frame)
        self.focus = NAME

    @property
    def written(self) -> str:
        """Return the name without spaces at its ends."""
        return " ".join(self.field.writing.text.split())

    def body(self) -> Iterator[Element]:
        yield self.field.element(self.focus == NAME)

    def is_on(self, name: str) -> bool:
        return name != "next" or not name_problem(self.written)

    def pressed(self, name: str, event: Pressed) -> None:
        if name == NAME:
            self.field.press(event.x, event.y)

    def typed(self, name: str | None, text: str) -> None:
        if name == NAME and len(self.field.writing.text) < LONGEST_NAME:
            self.field.type(text)
            self.notice, self._warned = (), ""

    def key(self, name: str | None, event: Key) -> bool:
        return name == NAME and event.name != "enter" and self.field.key(event)

    def go_on(self) -> None:
        if problem := name_problem(self.written):
            self.tell(problem)
        elif self._taken(self.written) and self._warned != self.written:
            self._warned = self.written
            self.tell("name_taken", name=self.written)
            self.wait_a_moment()
        else:
            self.finish(name=self.written)


class OpenScreen(Aside):
    """The page on which a saved design is chosen."""

    def __init__(self, page: Page, names: Sequence[str]) -> None:
        texts = page.texts
        self._sheets = dealt(names, -(-len(names) // ROWS))
        right = (Choice("more", texts("more")),) if len(self._sheets) > 1 else ()
        frame = Frame(page, texts("open_prompt"), "", (Choice("leave", texts("cancel")),), right)
        super().__init__(frame, len(self._sheets))
        self.focus, self.by_key = self._row(0), True

    def body(self) -> Iterator[Element]:
        body, unit = self.frame.body, self.page.metrics.unit
        height, gap = self.page.metrics.target(11), unit(2.2)
        width = min(body.width, unit(170))
        for number, name in enumerate(self._sheets[self.sheet]):
            box = Box(body.left + (body.width - width) // 2, body.top + number * (height + gap), width, height)
            laid = fitted(self.page, name, width - unit(8), height, HINT_STEPS)
            yield Button(self._row(number), box, laid=laid)

    def chosen(self, name: str, /) -> None:
        if name.startswith("design "):
            self.finish(name=self._sheets[self.sheet][int(name.removeprefix("design "))])
        elif name == "more":
            self._turn((self.sheet + 1) % self.sheets)
        else:
            self.leave()

    def key(self, _name: str | None, event: Key) -> bool:
        if event.name not in ("up", "down"):
            return False
        rows = [self._row(number) for number in range(len(self._sheets[self.sheet]))]
        self.move_focus(1 if event.name == "down" else -1, rows)
        return True

    def default_choice(self) -> None:
        """Return no default button: Enter opens the focused design, and nothing else."""

    def _row(self, number: int) -> str:
        return f"design {number}"


class HelpScreen(Aside):
    """The help page."""

    def __init__(self, page: Page) -> None:
        texts = page.texts
        left, right = (Choice("back", texts("back")),), (Choice("leave", texts("back_to_door"), primary=True),)
        frame = Frame(page, texts("help_title"), "", left, right)
        self._pages = paged(page, texts("help_text"), frame.body)
        if len(self._pages) > 1:
            frame = Frame(page, texts("help_title"), "", left, (Choice("more", texts("more")), *right))
        super().__init__(frame, len(self._pages))

    def body(self) -> Iterator[Element]:
        yield from self._pages[self.sheet]

    def chosen(self, name: str, /) -> None:
        if name == "more" and self.sheet < self.sheets - 1:
            self._turn(self.sheet + 1)
        else:
            self.leave()


class RecoverScreen(Aside):
    """The page after unfinished work was found: resume it, or begin anew."""

    def __init__(self, page: Page, name: str) -> None:
        texts = page.texts
        left, right = (Choice("anew", texts("begin_anew")),), (Choice("next", texts("go_on"), primary=True),)
        frame = Frame(page, texts("recover_prompt"), "", left, right)
        text = texts("recover_named", name=name) if name else texts("recover_text")
        self._pages = paged(page, text, frame.body)
        super().__init__(frame)

    def body(self) -> Iterator[Element]:
        yield from self._pages[0]

    def go_back(self) -> None:
        """Do nothing, because on this page only a button decides."""

"""Rate the similarity of stimuli while switching between them; every side must be felt before going on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Missing, back_and_next
from palpate.devices.window.screens.elements import Element, Label
from palpate.devices.window.screens.frame import STEPS, Frame, fitted, trial_frame
from palpate.devices.window.screens.sliders import PlacedAttribute, SliderScreen, rows
from palpate.devices.window.screens.targets import Button
from palpate.protocols.events import Ask
from palpate.protocols.forms import Sliders

TALL, WIDE = 20.0, 84.0
SIDE = "side "


@dataclass
class Switching:
    """A record of when which side was switched to, and for how long each was on."""

    sides: tuple[str, ...]
    on: str | None = None
    since_s: float = 0.0
    switches: list[dict[str, Any]] = field(default_factory=list)
    spent_s: dict[str, float] = field(default_factory=dict)

    def to(self, side: str, at_s: float) -> None:
        """Switch to a side; the current side again is not a switch."""
        if side == self.on:
            return
        self._count(at_s)
        self.on, self.since_s = side, at_s
        self.switches.append({"to": side, "at_s": round(at_s, 3)})

    def value(self, at_s: float) -> dict[str, Any]:
        """Return the switches and durations until now, for the ledger."""
        self._count(at_s)
        self.since_s = at_s
        return {"switches": self.switches, "side_s": {s: round(self.spent_s.get(s, 0.0), 3) for s in self.sides}}

    def unvisited(self) -> list[str]:
        """Return the sides that were never on."""
        visited = {switch["to"] for switch in self.switches}
        return [side for side in self.sides if side not in visited]

    def _count(self, at_s: float) -> None:
        if self.on is not None:
            self.spent_s[self.on] = self.spent_s.get(self.on, 0.0) + at_s - self.since_s


class SimilarityScreen(SliderScreen):
    """A slider form with a large button for each side; keys 1, 2, ... or a side's first letter switch too."""

    def __init__(self, ask: Ask, form: Sliders, page: Page, t0_ns: int) -> None:
        self.switching = Switching(form.sides)
        self._revising = ask.previous is not None
        super().__init__(ask, form, page, t0_ns)
        room, unit, count = self._room, self.page.metrics.unit, len(self.form.sides)
        gap = unit(6)
        width = min(unit(WIDE), (room.width - (count - 1) * gap) // count)
        left = room.left + (room.width - count * width - (count - 1) * gap) // 2
        top, height = room.top + self._side_label_height + self._apart, self.page.metrics.target(TALL)
        buttons = {}
        for n, side in enumerate(self.form.sides):
            words = f"{n + 1}   {_called(self.page, side)}"
            laid = fitted(self.page, words, width - unit(6), height, (7.0, 6.2, *STEPS), bold=True)
            buttons[f"{SIDE}{n}"] = Button(f"{SIDE}{n}", Box(left + n * (width + gap), top, width, height), laid=laid)
        self._sides = buttons

    def body(self) -> Iterator[Element]:
        yield self._side_label
        for name, button in self._sides.items():
            yield Button(name, button.box, laid=button.laid, chosen=self._side(name) == self.side)
        yield from super().body()

    def missing(self) -> Sequence[Missing]:
        unvisited = [] if self._revising else self.switching.unvisited()
        felt = [(f"{SIDE}{self.form.sides.index(side)}", _called(self.page, side)) for side in unvisited]
        return [*felt, *super().missing()]

    def complain(self, missing: Sequence[Missing], /, key: str = "please_answer") -> None:
        first = [place for place in missing if place[0].startswith(SIDE)]
        super().complain(first or missing, "please_visit" if first else key)

    def chosen(self, name: str) -> None:
        self._switch(self._side(name))

    def typed(self, _name: str | None, text: str, /) -> None:
        # What can be typed for a side: its number, and its first letter where no other side has it.
        letters = [_called(self.page, side)[:1].lower() for side in self.form.sides]
        by_letter = {
            letter: side for letter, side in zip(letters, self.form.sides, strict=True) if letters.count(letter) == 1
        }
        side = (by_letter | {str(n): side for n, side in enumerate(self.form.sides, start=1)}).get(text.strip().lower())
        if side is not None:
            self._switch(side)

    def key(self, name: str | None, event: Key) -> bool:
        return not (name or "").startswith(SIDE) and super().key(name, event)

    def value(self) -> dict[str, Any]:
        return {**super().value(), **self.switching.value(self.now_s)}

    def _switch(self, side: str) -> None:
        self.switching.to(side, self.now_s)
        self.side, self.notice = side, ()

    def _frame_for(self, page: Page, ask: Ask, form: Sliders, /) -> Frame:
        left, right = back_and_next(page)
        keys = ", ".join(str(n + 1) for n in range(len(form.sides)))
        return trial_frame(page, ask, "similarity_prompt", page.texts("similarity_hint", keys=keys), left, right)

    def _lines(self) -> list[list[PlacedAttribute]]:
        room, taken = (
            self._room,
            self._side_label_height + self._apart + self.page.metrics.target(TALL) + 3 * self._apart,
        )
        lower = Box(room.left, room.top + taken, room.width, room.height - taken)
        return rows(self.page, self.form.attributes, lower, self.form.scale)

    @property
    def _room(self) -> Box:
        """Return the body, or the part of its middle that a short form fills."""
        body, unit = self.frame.body, self.page.metrics.unit
        height = min(body.height, unit(50) + len(self.form.attributes) * unit(38))
        return Box(body.left, body.top + (body.height - height) // 3, body.width, height)

    @property
    def _apart(self) -> int:
        return self.page.metrics.unit(3)

    @property
    def _side_label_height(self) -> int:
        return round(1.5 * self.page.metrics.text(STEPS[0]))

    @property
    def _side_label(self) -> Label:
        """Return a label of the current side, because colour alone would not show it to all."""
        room, texts = self._room, self.page.texts
        on = self.side
        words = texts("sides_none") if on is None else texts("sides_label", side=_called(self.page, on))
        box = Box(room.left, room.top, room.width, self._side_label_height)
        return Label("side told", box, laid=fitted(self.page, words, box.width, box.height, STEPS), align="centre")

    def _side(self, name: str) -> str:
        return self.form.sides[int(name.removeprefix(SIDE))]


def _called(page: Page, side: str) -> str:
    """Return a side's name in the participant's language."""
    words = page.say(side).replace("_", " ")
    return words[:1].upper() + words[1:]

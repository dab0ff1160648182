"""Rating on lines: no ticks, no numbers, no marker before the first touch; Next is off until all are answered.

Of every marker the answer is kept, when and how often it was touched, and its path.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.devices.window.geometry import Box
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import Choice, Frame
from palpate.devices.window.screens.rows import Row, rows
from palpate.protocols.events import Ask, Samples
from palpate.protocols.forms import Sliders

FINE = 100
"""Steps from end to end by keyboard where the scale has none."""
COARSE = 10
"""Steps that the page keys take at once."""
ROW = struct.Struct("<3f")


class SliderScreen(Base):
    """One line for each attribute."""

    def __init__(self, ask: Ask, form: Sliders, page: Page, t0_ns: int) -> None:
        super().__init__(self._frame_for(page, ask, form), may_go_back=ask.may_go_back)
        self.form = form
        self.marks = Marks(form, t0_ns, dict(ask.previous or {}))
        self._sheets = self._lines()
        self.lay_out_on(len(self._sheets))

    def _frame_for(self, page: Page, ask: Ask, _form: Sliders, /) -> Frame:
        left, right = back_and_next(page)
        return trial_frame(page, ask, "sliders_prompt", page.texts("sliders_hint"), left, right)

    def _lines(self) -> list[list[Row]]:
        return rows(self.page, self.form.attributes, self.room, self.form.scale)

    @property
    def room(self) -> Box:
        """Where the lines stand."""
        return self.frame.body

    def body(self) -> Iterator[Element]:
        for row in self._sheets[self.sheet]:
            yield from row.fixed
            answer = self.marks.answers.get(self.form.attributes[self._attribute(row.track.name)].name)
            scale = self.form.scale
            share = None if answer is None else (answer - scale.low) / (scale.high - scale.low)
            yield replace(row.track, share=share, held=row.track.name == self.held)

    def missing(self) -> Sequence[Missing]:
        sliders = [(row.track.name, self._attribute(row.track.name)) for row in self._sheets[self.sheet]]
        return [
            (name, f"{self.page.say(self.form.attributes[n].low)} – {self.page.say(self.form.attributes[n].high)}")
            for name, n in sliders
            if self.form.attributes[n].name not in self.marks.answers
        ]

    def value(self) -> dict[str, Any]:
        return self.marks.value()

    def so_far(self) -> Mapping[str, float]:
        return dict(self.marks.answers)

    def samples(self) -> tuple[Samples, ...]:
        return self.marks.samples()

    def pressed(self, name: str, event: Pressed) -> None:
        if name.startswith("slider "):
            self.marks.touch(self._attribute(name))
            self._set_from(name, event)

    def dragged(self, name: str, event: Moved | Released) -> None:
        if name.startswith("slider "):
            self._set_from(name, event)

    def key(self, name: str | None, event: Key) -> bool:
        if event.name in ("up", "down"):
            self.move_focus(1 if event.name == "down" else -1, [row.track.name for row in self._sheets[self.sheet]])
            return True
        if name is None and event.name in ("left", "right", "home", "end", "pageup", "pagedown"):
            self.focus = name = self._sheets[self.sheet][0].track.name
        if name is None or not name.startswith("slider "):
            return False
        number = self._attribute(name)
        scale = self.form.scale
        step = float(scale.step) if scale.step is not None else (scale.high - scale.low) / FINE
        moves = {"left": -step, "right": step, "pagedown": -COARSE * step, "pageup": COARSE * step}
        ends = {"home": float(scale.low), "end": float(scale.high)}
        before = self.marks.answers.get(self.form.attributes[number].name)
        if event.name in ends:
            value = ends[event.name]
        elif event.name in moves:
            value = (scale.low + scale.high) / 2 if before is None else before + moves[event.name]
        else:
            return False
        self.marks.touch(number, by_key=True)
        self._put(number, value)
        return True

    def show(self, answers: Mapping[str, Any]) -> None:
        self.marks.answers.update(answers)

    def _set_from(self, name: str, event: Pressed | Moved | Released) -> None:
        row = next(row for row in self._sheets[self.sheet] if row.track.name == name)
        scale = self.form.scale
        self._put(self._attribute(name), scale.low + row.track.share_at(event.x) * (scale.high - scale.low))

    def _put(self, number: int, value: float) -> None:
        self.marks.put(number, value, self.now_s)
        self.notice = ()

    @staticmethod
    def _attribute(name: str) -> int:
        return int(name.removeprefix("slider "))


def trial_frame(
    page: Page, ask: Ask, prompt: str, hint: str, left: tuple[Choice, ...], right: tuple[Choice, ...]
) -> Frame:
    """Return the frame of a trial's form: the progress, whether it is practice, and how to go back."""
    trial = ask.trial
    if ask.may_go_back:
        hint += "   " + page.texts("back_hint", back=page.texts("back"))
    label = page.texts("practice") if trial is not None and trial.practice else ""
    if page.may_rest and trial is not None:
        left = (*left, Choice("rest", page.texts("rest")))
    progress = (trial.number - 1) / page.total if trial is not None and page.total else None
    return Frame(page, page.texts(prompt), hint, left, right, label, progress)


@dataclass
class Marks:
    """Markers by attribute; one that was never touched has no answer, which is not the same as zero."""

    form: Sliders
    t0_ns: int
    answers: dict[str, float] = field(default_factory=dict)
    at_s: dict[str, float] = field(default_factory=dict)
    touches: dict[str, int] = field(default_factory=dict)
    path: bytearray = field(default_factory=bytearray)
    _keyed: int | None = None

    def touch(self, number: int, by_key: bool = False) -> None:
        """Count a touch of a marker; consecutive keys on one marker are one touch."""
        if by_key and self._keyed == number:
            return
        self._keyed = number if by_key else None
        name = self.form.attributes[number].name
        self.touches[name] = self.touches.get(name, 0) + 1

    def put(self, number: int, value: float, at_s: float) -> None:
        """Set a marker to the scale's nearest answer and record a change of it as a sample."""
        name = self.form.attributes[number].name
        answer = float(self.form.scale.nearest(value)) + 0.0  # a plain float, and never -0.0
        self.at_s[name] = round(at_s, 3)
        if self.answers.get(name) != answer:
            self.answers[name] = answer
            self.path += ROW.pack(number, at_s, answer)

    def value(self) -> dict[str, Any]:
        """Return the answers in the form's order, with times and touches of those that were touched."""
        return {
            part: {name: known[name] for name in self.form.items() if name in known}
            for part, known in (("answers", self.answers), ("at_s", self.at_s), ("touches", self.touches))
        }

    def samples(self) -> tuple[Samples, ...]:
        """Return the path of the markers; none where nothing was moved."""
        if not self.path:
            return ()
        channels, units = ("item", "time", "value"), ("index", "s", "scale")
        return (Samples("marker", channels, units, 0.0, self.t0_ns, bytes(self.path)),)

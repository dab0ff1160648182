"""The common frame of screens: the heading, the room for the body, and the foot with its buttons and hint."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.paint import ALERT, QUIET
from palpate.devices.window.paint_text import BLANK, Align, Laid, lay
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Element, Label, Progress
from palpate.devices.window.screens.targets import Button
from palpate.protocols.events import Ask

STEPS = (5.4, 5.0, 4.6, 4.2, 3.8)
"""Em sizes of text in the design's millimetres, tried in this order; none becomes smaller than the metrics' minimum."""
HINT_STEPS = (4.4, 4.0, 3.6)
CUT = 8
"""Number of letters by which a notice is shortened, repeatedly, until it fits."""
MARGIN = 8.0
FOOT = 12.0


@dataclass(frozen=True)
class Choice:
    """A button of the foot: its name, its text, and whether it leads on."""

    name: str
    words: str
    primary: bool = False


@dataclass(frozen=True)
class Frame:
    """The fixed parts of a screen; `left` and `right` are the buttons of the foot, from left to right."""

    page: Page
    prompt: str
    hint: str
    left: tuple[Choice, ...]
    right: tuple[Choice, ...]
    label: str = ""
    progress: float | None = None
    hint_above: bool = False

    @cached_property
    def body(self) -> Box:
        """Return the room between head and foot."""
        unit = self.page.metrics.unit
        top = self._heading.bottom + unit(3) if self.prompt else unit(MARGIN)
        return Box(unit(MARGIN), top, self.page.metrics.width_px - 2 * unit(MARGIN), self.foot.top - unit(4) - top)

    @cached_property
    def foot(self) -> Box:
        """Return the room of the buttons and the hint."""
        unit, metrics = self.page.metrics.unit, self.page.metrics
        height = metrics.target(FOOT)
        top = metrics.height_px - unit(6) - height
        return Box(unit(MARGIN), top, metrics.width_px - 2 * unit(MARGIN), height)

    @cached_property
    def buttons(self) -> dict[str, tuple[Box, Laid]]:
        """Return the place and the text of every button."""
        gap = self.page.metrics.unit(4)
        placed, x = {}, self.foot.left
        for choice in self.left:
            width, laid = self._button(choice)
            placed[choice.name] = Box(x, self.foot.top, width, self.foot.height), laid
            x += width + gap
        x = self.foot.right
        for choice in reversed(self.right):
            width, laid = self._button(choice)
            placed[choice.name] = Box(x - width, self.foot.top, width, self.foot.height), laid
            x -= width + gap
        return placed

    @cached_property
    def middle(self) -> Box:
        """Return the room of hints and notices: between the buttons, or beside the heading."""
        return self._beside if self.hint_above else self.between

    @cached_property
    def between(self) -> Box:
        """Return the room between the buttons."""
        gap = self.page.metrics.unit(6)
        lefts = [self.buttons[choice.name][0].right + gap for choice in self.left]
        rights = [self.buttons[choice.name][0].left - gap for choice in self.right]
        left, right = max(lefts, default=self.foot.left), min(rights, default=self.foot.right)
        return Box(left, self.foot.top - gap // 3, max(0, right - left), self.foot.height + 2 * (gap // 3))

    def elements(self, notice: Sequence[str] = ()) -> Iterator[Element]:
        """Yield heading, progress, and the notice (the first wording that fits) or else the hint, without buttons."""
        if self.progress is not None:
            box = Box(0, 0, self.page.metrics.width_px, self.page.metrics.unit(1.4))
            yield Progress("progress", box, share=self.progress)
        if self.prompt:
            yield Label("prompt", self._heading, laid=self._heading_laid)
        if self.label:
            yield self._practice
        align: Align = "right" if self.hint_above else "centre"
        if notice:
            yield Label("notice", self.middle, laid=self._notice(notice), colour=ALERT, align=align)
        elif self.hint:
            yield Label("hint", self.middle, laid=self._hint, colour=QUIET, align=align)

    def button(self, name: str, on: bool = True) -> Button:
        """Return a button of the foot as it looks now."""
        box, laid = self.buttons[name]
        primary = any(choice.name == name and choice.primary for choice in (*self.left, *self.right))
        return Button(name, box, laid=laid, primary=primary, on=on)

    @property
    def _beside(self) -> Box:
        """Return the room to the right of the heading."""
        unit = self.page.metrics.unit
        right = self.foot.right - (unit(34) if self.label else 0)
        left = self._heading.left + self._heading_laid.width + unit(6)
        return Box(left, unit(3.5), right - left, self._heading.height + 2 * unit(1.5))

    @cached_property
    def _heading_laid(self) -> Laid:
        return fitted(self.page, self.prompt, self._heading_width, None, (7.0, 6.4, *STEPS), bold=True)

    @cached_property
    def _heading(self) -> Box:
        unit, laid = self.page.metrics.unit, self._heading_laid
        width = laid.width + unit(1) if self.hint_above else self._heading_width
        return Box(unit(MARGIN), unit(5), width, laid.height)

    @property
    def _heading_width(self) -> int:
        """Return the width of the heading: everything, or the rest beside a hint and a label."""
        unit = self.page.metrics.unit
        full = self.page.metrics.width_px - 2 * unit(MARGIN) - unit(36)
        return round(0.45 * full) if self.hint_above else full

    @property
    def _practice(self) -> Label:
        unit = self.page.metrics.unit
        box = Box(self.foot.right - unit(34), unit(5), unit(34), self._heading.height)
        laid = fitted(self.page, self.label, box.width, box.height, STEPS)
        return Label("label", box, laid=laid, colour=QUIET, align="right")

    @cached_property
    def _hint(self) -> Laid:
        return fitted(self.page, self.hint, self.middle.width, self.middle.height, HINT_STEPS, even=True)

    def _notice(self, wordings: Sequence[str]) -> Laid:
        """Return the first wording that fits, or the last one shortened: a message never ends a session."""
        last, room = wordings[-1], self.middle
        shorter = (last[:stop].rstrip() + " …" for stop in range(len(last) - CUT, 0, -CUT))
        for words in (*wordings, *shorter):
            if laid := first_fit(self.page, words, room.width, room.height, STEPS, even=True):
                return laid
        return BLANK

    def _button(self, choice: Choice) -> tuple[int, Laid]:
        """Return width and text of a button, as wide as the text needs, within bounds."""
        unit = self.page.metrics.unit
        laid = fitted(self.page, choice.words, unit(70), self.foot.height, STEPS, bold=choice.primary, even=True)
        return max(unit(38), laid.width + unit(10)), laid


def fitted(
    page: Page,
    text: str,
    width: int,
    height: int | None,
    steps: Sequence[float],
    bold: bool = False,
    even: bool = False,
) -> Laid:
    """Return the text at the first size at which it fits. Raises WindowError if even the smallest does not."""
    laid = first_fit(page, text, width, height, steps, bold, even)
    if laid is None:
        metrics = page.metrics
        room = f"{width / metrics.px_per_mm:.0f} mm" + (
            "" if height is None else f" x {height / metrics.px_per_mm:.0f} mm"
        )
        raise WindowError(
            f"{text!r:.120} does not fit into {room} on a screen of {metrics}, even at the smallest size "
            f"({metrics.text(steps[-1]) / metrics.px_per_mm:.1f} mm); shorten the text or use a larger screen"
        )
    return laid


def first_fit(
    page: Page,
    text: str,
    width: int,
    height: int | None,
    steps: Sequence[float],
    bold: bool = False,
    even: bool = False,
) -> Laid | None:
    """Return the text at the first size at which it fits, or None."""
    for size in dict.fromkeys(page.metrics.text(step) for step in steps):
        laid = lay(page.fonts, text, size, width, bold, even)
        if laid is not None and (height is None or laid.height <= height):
            return laid
    return None


def trial_frame(
    page: Page, ask: Ask, prompt: str, hint: str, left: tuple[Choice, ...], right: tuple[Choice, ...]
) -> Frame:
    """Return the frame of a trial's form: the progress, whether it is practice, and the button to go back."""
    trial = ask.trial
    if ask.may_go_back:
        hint += "   " + page.texts("back_hint", back=page.texts("back"))
    label = page.texts("practice") if trial is not None and trial.practice else ""
    if page.may_rest and trial is not None:
        left = (*left, Choice("rest", page.texts("rest")))
    progress = (trial.number - 1) / page.total if trial is not None and page.total else None
    return Frame(page, page.texts(prompt), hint, left, right, label, progress)

"""Sliders that stay visible while the stimulus is felt, with its force beside them if the study shows it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain

import numpy as np

from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.paint import ACCENT, QUIET
from palpate.devices.window.plot import Axes, Masks, axes_for
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.authoring import AuthoringScreen
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.frame import HINT_STEPS, Choice, Frame, fitted, trial_frame
from palpate.devices.window.screens.profile import Curve, Ground
from palpate.devices.window.screens.sliders import rows
from palpate.protocols.events import Ask
from palpate.protocols.forms import Sliders

BESIDE = (0.36, 0.3, 0.26)
"""Shares of the width for the plot beside the lines; the first that leaves them on one sheet is used."""
BELOW = 0.4
"""Share of the height for the plot below the lines, if none of these does."""
GAP, PAD = 4.0, 3.0
MINUS = "\N{MINUS SIGN}"
TICKS_N, TICKS_DEG = (20.0, 40.0, 100.0), (0, 20, 40, 60)


class LiveAuthoringScreen(AuthoringScreen):
    """An AuthoringScreen with lines that can be moved while the door is felt (`playing`), until Stop."""

    def __init__(self, ask: Ask, form: Sliders, page: Page, t0_ns: int, playing: bool) -> None:
        self.playing = playing
        self.plot = _split(form, self._frame_for(page, ask, form)) if form.shows_force else None
        super().__init__(ask, form, page, t0_ns)
        self.may_go_back = self.may_go_back and not playing

    @property
    def room(self) -> Box:
        return self.frame.body if self.plot is None else self.plot.lines

    def turned(self) -> None:
        stop = (Choice("stop", self.page.texts("live_stop"), primary=True),)
        if self.playing:
            self.frame = replace(self.frame, right=stop if self.deciding else (*stop, *self._turning))
        else:
            super().turned()

    def is_on(self, name: str) -> bool:
        return name == "stop" or super().is_on(name)

    def chosen(self, name: str, /) -> None:
        if name == "stop":
            self.finish(go="stop")
        elif not self.playing:
            super().chosen(name)

    def typed(self, name: str | None, text: str, /) -> None:
        if not self.playing:
            super().typed(name, text)

    def default_choice(self) -> str:
        if not self.playing:
            return super().default_choice()
        return "stop" if self.deciding else "next"

    def body(self) -> Iterator[Element]:
        drawn = () if self.plot is None else self.plot.elements(self.marks.answers)
        return chain(super().body(), drawn)

    def _frame_for(self, page: Page, ask: Ask, form: Sliders, /) -> Frame:
        if not self.playing:
            return super()._frame_for(page, ask, form)
        back = (Choice("back", page.texts("back")),)
        stop = (Choice("stop", page.texts("live_stop"), primary=True),)
        return trial_frame(page, ask, "live_prompt", page.texts("live_hint"), back, stop)


@dataclass
class Plot:
    """The plot of the force beside the lines, and its content."""

    page: Page
    lines: Box
    card: Box
    masks: Masks = field(default_factory=Masks)

    def elements(self, answers: Mapping[str, float]) -> Iterator[Element]:
        """Yield the card, its axes, and the curve if every line is set and a model can make doors."""
        force_N = self._force(answers)
        axes = axes_for(self._inner, *(() if force_N is None else (force_N,)))
        yield Card("force", self.card, radius=rounding(self.page))
        yield Ground("force ground", axes.box, "force", low_N=axes.low_N, high_N=axes.high_N, masks=self.masks)
        yield from self._words(axes)
        if force_N is not None:
            thick = max(2.0, 0.75 * self.page.metrics.unit(1))
            for number, piece in enumerate(self.masks.line(force_N, axes, thick)):
                yield Curve(f"force {number}", piece.box, "force ground", piece.cover, ACCENT)

    def _force(self, answers: Mapping[str, float]) -> np.typing.NDArray[np.float64] | None:
        if self.page.force_of is None or not answers:
            return None
        try:
            return np.array(self.page.force_of(dict(answers)))
        except ValueError:  # a line is not set yet
            return None

    @cached_property
    def _text_px(self) -> int:
        """Return the height of a line of text."""
        return fitted(self.page, "60", self.card.width, None, HINT_STEPS).height

    @cached_property
    def _inner(self) -> Box:
        unit, text = self.page.metrics.unit, self._text_px
        left = (
            self.card.left
            + unit(PAD)
            + unit(2)
            + fitted(self.page, f"{MINUS}60", self.card.width, None, HINT_STEPS).width
        )
        top = self.card.top + unit(PAD) + text + unit(2)
        right, bottom = self.card.right - 2 * unit(PAD), self.card.bottom - unit(PAD) - 5 * text // 2 - unit(3)
        return Box(left, top, right - left, bottom - top)

    def _words(self, axes: Axes) -> Iterator[Element]:
        texts, unit, inner, text = self.page.texts, self.page.metrics.unit, axes.box, self._text_px
        wide = self.card.width - 2 * unit(PAD)
        yield self._label("force axis", texts("force_axis"), Box(self.card.left + unit(PAD), self.card.top + unit(PAD),
                          wide, text), "left")  # fmt: skip
        step = next((n for n in TICKS_N if axes.y(0) - axes.y(n) > text), TICKS_N[-1])
        for force in (force for force in axes.forces_N if force % step == 0):
            number = f"{force:.0f}".replace("-", MINUS)
            place = Box(self.card.left + unit(PAD), axes.y(force) - text // 2, inner.left - unit(1) - self.card.left
                        - unit(PAD), text)  # fmt: skip
            yield self._label(f"{force:g} N", number, place, "right")
        for angle in TICKS_DEG:
            place = Box(axes.x(angle) - unit(6), inner.bottom + unit(1) + text // 2, unit(12), text)
            yield self._label(f"{angle} deg", f"{angle}", place, "centre")
        below = Box(self.card.left + unit(PAD), inner.bottom + unit(2) + 3 * text // 2, wide, text)
        yield self._label("angle axis", texts("angle_axis"), below, "centre")

    def _label(self, name: str, words: str, box: Box, align: str) -> Label:
        laid = fitted(self.page, words, box.width, box.height, HINT_STEPS)
        return Label(name, box, "force", laid, QUIET, align)  # type: ignore[arg-type]


def _split(form: Sliders, frame: Frame) -> Plot:
    """Return the plot beside the lines if they stay on one sheet, else below them."""
    page, body, gap = frame.page, frame.body, frame.page.metrics.unit(GAP)
    for share in BESIDE:
        width = round(share * body.width)
        lines = Box(body.left, body.top, body.width - width - gap, body.height)
        try:
            if len(rows(page, form.attributes, lines, form.scale)) > 1:
                continue
        except WindowError:
            continue
        height = min(body.height, round(0.9 * width))
        return Plot(page, lines, Box(lines.right + gap, body.top, width, height))
    height = round(BELOW * body.height)
    lines = Box(body.left, body.top, body.width, body.height - height - gap)
    width = min(body.width, 2 * height)
    return Plot(page, lines, Box(body.middle[0] - width // 2, lines.bottom + gap, width, height))

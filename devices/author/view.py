"""The view of the work: all elements as they look now, in the language of the window."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from palpate.devices.author.elements import FEELS, SIDES, Felt, Pane, Upright
from palpate.devices.author.layout import LEFT_BUTTONS, Layout, buttons, lay_out
from palpate.devices.author.plotter import Hand, Plotter
from palpate.devices.author.work import MOST_SMOOTHING_DEG, Setting, Work
from palpate.devices.door.making import NEUTRAL, DesignedDoor, Maker
from palpate.devices.window.app import AppView, Status
from palpate.devices.window.geometry import Box
from palpate.devices.window.paint import ALERT, INK, QUIET
from palpate.devices.window.paint_text import Laid
from palpate.devices.window.screens.elements import Element, Label, rounding
from palpate.devices.window.screens.sliders import Track
from palpate.devices.window.screens.targets import Button
from palpate.devices.window.texts import MASTER, Texts, window_texts
from palpate.devices.window.typeset import NUMBER_STEPS, WORD_STEPS
from palpate.signals.arrays import Array

KEPT = 50
"""Number of doors that are cached."""
FOLDER = Path(__file__).resolve().parent / "texts"
NAMED_OFF, NOTICED = 3, 10.0
"""Greatest number of unattainable wishes that are named, and the least noticeable difference between wish and door."""


@dataclass(frozen=True, kw_only=True)
class DesignerStatus(Status):
    """The notice, the door's state, the main button's action, and the hand's position.

    While a slider is being `moved`, unattainable wishes are not named: the dots show them, and a sentence that changes
    with every pixel cannot be read or laid out in time.
    """

    door: str = ""
    play: str = "play"
    hand: Hand | None = None
    moved: bool = False


@dataclass
class DesignerView(AppView):
    """A builder of the window's elements, which makes a door once for each setting."""

    maker: Maker
    _designed: dict[Setting, DesignedDoor] = field(default_factory=dict)
    _foot_words: tuple[str, ...] = ()
    _foot_buttons: dict[str, tuple[Box, Laid]] = field(default_factory=dict)

    @cached_property
    def layout(self) -> Layout:
        """Return the layout of the window."""
        return lay_out(self.page, len(self.maker.attributes))

    @cached_property
    def plotter(self) -> Plotter:
        """Return the plotter of the doors."""
        return Plotter(self.setter, self.layout)

    def made(self, setting: Setting) -> DesignedDoor:
        """Return the door of a setting."""
        if setting not in self._designed:
            if len(self._designed) >= KEPT:
                del self._designed[next(iter(self._designed))]
            self._designed[setting] = self.maker.design(np.array(setting.wish), setting.smoothing_deg)
        return self._designed[setting]

    def elements(self, work: Work, status: DesignerStatus) -> Iterator[Element]:
        """Yield all elements, from the background up."""
        head, unit, close = self.layout.head, self.page.metrics.unit, self.layout.close
        yield (title := self.title(head))
        left, right = title.box.right + unit(6), close.left - unit(5)
        state = self.setter.cut(status.door, unit(105), head.height)
        name = self.setter.cut(self._name(work), right - state.width - unit(4) - left, head.height)
        yield Label("name", Box(left, head.top, name.width, head.height), laid=name, colour=QUIET)
        yield Label("state", Box(right - state.width, head.top, state.width, head.height), laid=state, colour=QUIET)
        yield self.close_button(close)
        yield Pane("wishes", self.layout.wishes, radius=rounding(self.page))
        yield Pane("door", self.layout.door, radius=rounding(self.page))
        yield from self._wishes(work)
        beside = None if work.other is None else self.made(work.other).force_N
        yield from self.plotter.elements(work, self.made(work.setting).force_N, beside, status.hand)
        texts, place = self.page.texts, self.layout
        yield self.setter.label("smoothing label", texts("smoothing"), place.panel.smoothing_label, within="door")
        yield self.smoother(work)
        value = texts("smoothing_value", degrees=f"{work.setting.smoothing_deg:.1f}")
        yield self.setter.label("smoothing value", value, place.panel.smoothing_value, QUIET, "right", within="door")
        yield self._words(work, status)
        yield from self._foot(work, status)

    def slider(self, work: Work, number: int) -> Upright:
        """Return one of the vertical sliders."""
        other = work.other
        return Upright(
            f"wish {number}", self.layout.columns.sliders[number], "wishes", wish=work.setting.wish[number],
            beside=None if other is None else other.wish[number], colour=SIDES[work.on],
            other=SIDES["A" if work.on == "B" else "B"],
        )  # fmt: skip

    def smoother(self, work: Work) -> Track:
        """Return the slider of the smoothing."""
        box = self.layout.panel.smoothing
        share = work.setting.smoothing_deg / MOST_SMOOTHING_DEG
        return Track("smoothing", box, "door", line_px=box.width - self.page.metrics.unit(8), share=share)

    def _name(self, work: Work) -> str:
        if not work.name:
            return self.page.texts("unnamed")
        return work.name if work.saved == work.setting else self.page.texts("changed", name=work.name)

    def _wishes(self, work: Work) -> Iterator[Element]:
        made, place, texts = self.made(work.setting), self.layout, self.page.texts
        for number, (low, high) in enumerate(zip(self.maker.attributes, self.maker.antonyms, strict=True)):
            feels, wished = round(float(made.predicted[number])), f"{work.setting.wish[number]:.0f}"
            yield self._end(f"high {number}", word(texts, high), place.columns.highs[number])
            slider = self.slider(work, number)
            yield slider
            yield Felt.beside(f"dot {number}", slider, feels, self.page)
            yield self._end(f"low {number}", word(texts, low), place.columns.lows[number])
            for name, text, box, colour in (
                ("wished", wished, place.columns.wished[number], SIDES[work.on]),
                ("feels", f"{feels}", place.columns.feels[number], FEELS),
            ):
                bold = name == "wished"
                yield self.setter.label(
                    f"{name} {number}", text, box, colour, "centre", NUMBER_STEPS, bold, within="wishes"
                )

    def _end(self, name: str, text: str, box: Box) -> Label:
        return self.setter.label(name, text, box, align="centre", steps=self._word_steps, even=True, within="wishes")

    @cached_property
    def _word_steps(self) -> tuple[float, ...]:
        words = [word(self.page.texts, adjective) for adjective in (*self.maker.attributes, *self.maker.antonyms)]
        return self.setter.same_size(words, self.layout.columns.highs[0].width, self.layout.columns.highs[0].height)

    def _words(self, work: Work, status: DesignerStatus) -> Label:
        texts, box, made = self.page.texts, self.layout.panel.words, self.made(work.setting)
        text, colour = f"{texts('as_wished')}  {texts('hint')}", QUIET
        if status.notice:
            text, colour = status.notice, ALERT if status.wrong else INK
        elif status.moved:
            text, colour = (texts("as_wished"), QUIET) if made.attainable else (texts("not_all"), FEELS)
        elif not made.attainable:
            text, colour = what_is_off(texts, self.maker, work.setting.wish, made.predicted), FEELS
        return Label("words", box, "door", self.setter.cut(text, box.width, box.height, WORD_STEPS), colour)

    def _foot(self, work: Work, status: DesignerStatus) -> Iterator[Element]:
        texts = self.page.texts
        words = {name: texts(name) for name in LEFT_BUTTONS}
        if work.b is not None:
            words["compare"] = texts("keep_one", side=work.on)
        key = (*words.values(), status.play)
        if key != self._foot_words:
            self._foot_words, self._foot_buttons = key, buttons(self.page, self.layout.foot, words, status.play)
        for name, (box, laid) in self._foot_buttons.items():
            yield Button(name, box, laid=laid, primary=name == "play")


def author_texts(language: str = MASTER) -> Texts:
    """Return the texts of the window and of the pages that it shares with others. Raises WindowError."""
    return window_texts(FOLDER, "designer", language)


def word(texts: Texts, name: str) -> str:
    """Return an attribute's word in the language, or the model's own word if there is none."""
    return texts.words.get(f"word.{name}", name)


def what_is_off(texts: Texts, maker: Maker, wish: tuple[float, ...], predicted: Array) -> str:
    """Return a sentence that says which wishes the nearest door misses most, in the language of the window."""
    off = [abs(felt - wished) for felt, wished in zip(predicted.tolist(), wish, strict=True)]
    misses = sorted((number for number in range(len(wish)) if off[number] > NOTICED), key=lambda number: -off[number])
    parts = [
        texts(
            "not_had_part", word=word(texts, _end(maker, number, wish[number])), wished=f"{wish[number]:.0f}",
            feels=f"{predicted[number]:.0f}",
        )
        for number in sorted(misses[:NAMED_OFF])
    ]  # fmt: skip
    return texts("not_had", list=", ".join(parts))


def _end(maker: Maker, number: int, wish: float) -> str:
    """Return the word of the slider's end that the wish is nearer to."""
    return (maker.antonyms if wish >= NEUTRAL else maker.attributes)[number]

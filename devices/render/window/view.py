"""The view of the window: all elements as they look now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.devices.render.window.choice import FIRMEST_N as FIRMEST_PRESS_N
from palpate.devices.render.window.choice import LIGHTEST_N, Choice, Models, in_view, method_word, texture_word
from palpate.devices.render.window.elements import (
    DECIBELS,
    HERTZ,
    LEAST_DB,
    MOST_DB,
    Gauge,
    Heard,
    Spectrum,
    Touched,
    Wave,
    scale_for,
)
from palpate.devices.render.window.layout import MOST_CHIPS, Layout, Slider, lay_out
from palpate.devices.render.window.photo import Photo, at_true_size, photo_file, read_photo
from palpate.devices.window.app import AppView, Status
from palpate.devices.window.geometry import Box, WindowError
from palpate.devices.window.paint import ALERT, QUIET
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Card, Element, Label, rounding
from palpate.devices.window.screens.sliders import Track
from palpate.devices.window.screens.targets import Button
from palpate.devices.window.typeset import LABEL_STEPS, SMALL_STEPS, WORD_STEPS, line_px
from palpate.signals.models.card import Card as ModelCard
from palpate.signals.models.errors import ModelFileError
from palpate.signals.models.file import read_card
from palpate.signals.textures.range import FASTEST_MM_S, FIRMEST_N

if TYPE_CHECKING:
    from PIL import Image

MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True, kw_only=True)
class RendererStatus(Status):
    """The timing (a rendering's record), the notice, and whether the renderer is silent."""

    record: Mapping[str, Any] = field(default_factory=dict)
    silent: bool = False


@dataclass(frozen=True)
class Picture:
    """A texture's picture as it is shown, or why there is none."""

    photo: Photo | None = None
    shown: Image.Image | None = None
    why: str = ""


@dataclass
class RendererView(AppView):
    """A builder of the elements. `by_mouse`: strokes come from the pointer, with the force of a slider."""

    models: Models
    by_mouse: bool = True
    _cards: dict[Path, ModelCard | None] = field(default_factory=dict)
    _pictures: dict[Path, Picture] = field(default_factory=dict)

    @cached_property
    def layout(self) -> Layout:
        """Return the layout of the window."""
        return lay_out(self.page)

    def elements(self, choice: Choice, heard: Heard, status: RendererStatus) -> Iterator[Element]:
        """Yield all elements, from the background up."""
        place, radius = self.layout, rounding(self.page)
        yield from self._head()
        yield Card("touch", place.touch, radius=radius)
        yield Card("played", place.played, radius=radius)
        card = self.models[choice.texture][choice.method]
        if card not in self._pictures:
            self._pictures[card] = self._read(card)
        picture = self._pictures[card]
        name = "" if picture.photo is None else str(picture.photo.path)
        yield Touched("picture", self.layout.picture, "touch", shown=picture.shown, of=f"{choice.texture} {name}")
        if picture.shown is None:
            box = self.layout.picture.grown(-self.page.metrics.unit(6))
            text = " ".join(filter(None, (self.page.texts("no_picture") + ".", picture.why)))
            laid = self.setter.cut(text, box.width, box.height, WORD_STEPS)
            yield Label("no picture", box, "picture", laid, QUIET, "centre")
        texts = self.page.texts
        volume = texts("silent") if status.silent else texts("volume_value", percent=f"{100 * choice.volume:.0f}")
        yield from self._slider("volume", texts("volume"), volume, self.layout.volume)
        yield self.track("volume", choice)
        if self.by_mouse:
            force = texts("force_value", force=f"{choice.force_N:.1f}")
            yield from self._slider("press", texts("press"), force, self.layout.press)
            yield self.track("press", choice)
        yield from self._plots(choice, heard)
        yield from self._gauges(heard)
        yield from self._figures(heard, status.record)
        yield self._words(status)
        yield from self._chips(choice)

    def track(self, name: str, choice: Choice) -> Track:
        """Return the slider of the volume, or of the mouse's force."""
        place = getattr(self.layout, name)
        span = FIRMEST_PRESS_N - LIGHTEST_N
        share = choice.volume if name == "volume" else (choice.force_N - LIGHTEST_N) / span
        return Track(name, place.track, "touch", line_px=place.track.width - self.page.metrics.unit(8), share=share)

    def mm_at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the screen lies on the picture, in mm from its top left corner."""
        box, per_mm = self.layout.picture, self.page.metrics.px_per_mm
        return (x - box.left) / per_mm, (y - box.top) / per_mm

    def _head(self) -> Iterator[Element]:
        place, texts, unit = self.layout, self.page.texts, self.page.metrics.unit
        yield (title := self.title(place.head))
        left = title.box.right + unit(6)
        box = Box(left, place.head.top, place.close.left - unit(5) - left, place.head.height)
        hint = texts("hint_mouse" if self.by_mouse else "hint_stylus")
        yield Label("hint", box, laid=self.setter.cut(hint, box.width, box.height, SMALL_STEPS), colour=QUIET,
                    align="right")  # fmt: skip
        yield self.close_button(place.close)

    def _read(self, path: Path) -> Picture:
        card, room = self._card(path), self.layout.picture
        file = None if card is None else photo_file(card, path.parent)
        if file is None:
            return Picture()
        try:
            photo = read_photo(file)
            shown = at_true_size(photo, self.page.metrics.px_per_mm, (room.width, room.height))
        except (WindowError, OSError) as error:
            return Picture(why=str(error))
        return Picture(photo, shown)

    def _card(self, path: Path) -> ModelCard | None:
        """Return the model's card; None if it cannot be read, because playing it says why."""
        if path not in self._cards:
            try:
                self._cards[path] = read_card(path)
            except ModelFileError:
                self._cards[path] = None
        return self._cards[path]

    def _slider(self, name: str, text: str, value: str, place: Slider) -> Iterator[Element]:
        yield self.setter.label(f"{name} label", text, place.label, within="touch")
        yield self.setter.label(f"{name} value", value, place.value, QUIET, "right", within="touch")

    def _plots(self, choice: Choice, heard: Heard) -> Iterator[Element]:
        texts, place = self.page.texts, self.layout
        # The axis holds what the texture is recorded with, and what is played.
        card = self._card(self.models[choice.texture][choice.method])
        usual = 0.0 if card is None or card.texture is None else 3 * card.texture.rms_m_s2
        samples = heard.samples
        scale = scale_for(max(usual, float(abs(samples).max()) if samples.size else 0.0))
        yield self.setter.label("output", texts("output"), place.wave.name, QUIET, steps=SMALL_STEPS, within="played")
        yield Wave("wave", place.wave.box, "played", heard.acceleration, scale)
        yield from self._numbers("wave", {scale: 0.0, 0.0: 0.5, -scale: 1.0}, place.wave.numbers)
        yield self.setter.label("spectrum name", texts("spectrum"), place.spectrum.name, QUIET, steps=SMALL_STEPS,
                                within="played")  # fmt: skip
        spectrum = Spectrum("spectrum", place.spectrum.box, "played", heard.acceleration)
        yield spectrum
        inner = DECIBELS[1:-1]
        levels = {float(level): (MOST_DB - level) / (MOST_DB - LEAST_DB) for level in inner}
        yield from self._numbers("spectrum", levels, place.spectrum.numbers)
        unit, hertz_box = self.page.metrics.unit, place.hertz
        for hertz in HERTZ:
            half = unit(7)
            left = min(spectrum.x(hertz) - half, hertz_box.right - 2 * half)
            yield self.setter.label(f"{hertz} Hz", f"{hertz}", Box(left, spectrum.box.bottom + unit(0.5), 2 * half,
                                    hertz_box.height), QUIET, "centre", (3.8,), within="played")  # fmt: skip

    def _numbers(self, name: str, places: Mapping[float, float], box: Box) -> Iterator[Element]:
        line = line_px(self.page, 3.8)
        for value, share in places.items():
            row = box.top + round(share * (box.height - 1)) - line // 2
            top = min(max(row, box.top), box.bottom - line)
            text = f"{value:g}".replace("-", MINUS)
            yield self.setter.label(f"{name} {value:g}", text, Box(box.left, top, box.width, line), QUIET, "right",
                                    (3.8,), within="played")  # fmt: skip

    def _gauges(self, heard: Heard) -> Iterator[Element]:
        texts = self.page.texts
        speed = texts("speed_value", speed=f"{heard.speed_mm_s:.0f}")
        force = texts("force_value", force=f"{heard.force_N:.2f}")
        yield from self._gauge("speed", speed, heard.speed_mm_s / FASTEST_MM_S, self.layout.speed)
        yield from self._gauge("force", force, heard.force_N / FIRMEST_N, self.layout.force)

    def _gauge(self, name: str, value: str, share: float, place: Slider) -> Iterator[Element]:
        text = self.page.texts(name)
        yield self.setter.label(f"{name} label", text, place.label, QUIET, steps=SMALL_STEPS, within="played")
        yield Gauge(f"{name} gauge", place.track, "played", share)
        yield self.setter.label(f"{name} value", value, place.value, align="right", steps=SMALL_STEPS, within="played")

    def _figures(self, heard: Heard, record: Mapping[str, Any]) -> Iterator[Element]:
        for (name, value), box in zip(figures(self.page, heard, record), self.layout.cells, strict=True):
            line = line_px(self.page, SMALL_STEPS[-1])
            top = Box(box.left, box.top, box.width, line)
            yield self.setter.label(f"{name} name", self.page.texts(name), top, QUIET, steps=SMALL_STEPS,
                                    within="played")  # fmt: skip
            below = Box(box.left, box.top + line, box.width - self.page.metrics.unit(1), line)
            laid = self.setter.cut(value, below.width, below.height, SMALL_STEPS)
            yield Label(f"{name} figure", below, "played", laid)

    def _words(self, status: RendererStatus) -> Label:
        box = self.layout.words
        laid = self.setter.cut(status.notice, box.width, box.height, SMALL_STEPS)
        return Label("words", box, "played", laid, ALERT if status.wrong else QUIET)

    def _chips(self, choice: Choice) -> Iterator[Element]:
        texts = self.page.texts
        textures = in_view(tuple(self.models), choice.texture, MOST_CHIPS)
        methods = in_view(tuple(self.models[choice.texture]), choice.method, MOST_CHIPS)
        rows = (
            ("texture", self.layout.textures, choice.texture, {name: texture_word(texts, name) for name in textures}),
            ("method", self.layout.methods, choice.method, {name: method_word(texts, name) for name in methods}),
        )
        for kind, row, chosen, names in rows:
            gap = self.page.metrics.unit(2.4)
            width = (row.width - gap * (MOST_CHIPS - 1)) // MOST_CHIPS
            for place, (name, text) in enumerate(names.items()):
                box = Box(row.left + place * (width + gap), row.top, width, row.height)
                laid = self.setter.cut(text, width - self.page.metrics.unit(4), row.height, LABEL_STEPS)
                yield Button(f"{kind} {name}", box, laid=laid, chosen=name == chosen)


def figures(page: Page, heard: Heard, record: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return names and values of the six figures: the record's times, and the level."""
    ready, output, voice = (record.get(name) or {} for name in ("ready", "output", "voice"))
    ahead, worst = output.get("ahead_ms"), page.texts("worst_value", worst=f"{ready.get('worst_us', 0.0) / 1000:.2g}")
    texts, share = page.texts, f"{100 * ready.get('late_share', 0.0):.2g}"
    return (
        ("steps", f"{ready.get('steps', 0)}"),
        ("late", texts("late_value", late=ready.get("late", 0), share=share)),
        ("underruns", texts("underruns_value", underruns=output.get("underruns", 0), missing=output.get("missing", 0))),
        ("level", texts("level_value", level=f"{heard.level_m_s2:.2g}")),
        (("worst", worst) if ahead is None else ("worst_buffer", f"{worst} / {texts('buffer_value', ahead=ahead)}")),
        ("runtime", str(voice.get("runtime", "–"))),
    )  # fmt: skip

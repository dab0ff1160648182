"""Put stimuli in order after feeling them: cards that are dragged, or moved by keys, along a row of places."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from string import ascii_uppercase
from typing import TYPE_CHECKING, Any

from palpate.devices.window.geometry import NEAREST_TARGETS_MM, Box
from palpate.devices.window.inputs import Key, Moved, Pressed, Released
from palpate.devices.window.paint import ACCENT, CARD, EDGE, GROUND, HAIR, INK, TINT
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.authoring import TRY_KEYS
from palpate.devices.window.screens.base import Base, Missing, back_and_next
from palpate.devices.window.screens.elements import Element, Label, hair, rounding
from palpate.devices.window.screens.frame import STEPS, fitted, trial_frame
from palpate.devices.window.screens.specimens import Specimen, Wording
from palpate.devices.window.screens.targets import Button, Target
from palpate.protocols.events import Ask
from palpate.protocols.study import Attribute, Stimulus
from palpate.protocols.tasks.ranking import Ranking
from palpate.protocols.trial import Trial

if TYPE_CHECKING:
    from PIL import Image

CARD_NAME, SLOT_NAME, AGAIN = "card ", "place ", "again"
WIDEST, TALLEST = 30.0, 28.0
"""Greatest size of a place, in the design's millimetres."""
EDGE_MM = 0.6
"""How much of a place is visible around its card."""
TAP_MM = 4.0
"""Greatest move of a press that is not a drag."""
REACH = 14.0
"""How far above and below the row a card can be dropped, in the design's millimetres."""


@dataclass(frozen=True)
class Slot(Target):
    """A place for a card; the keyboard moves from card to card."""

    @property
    def stops(self) -> bool:
        return False

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, rounding(page), GROUND)
        page.shapes.frame(image, self.box, rounding(page), hair(page), HAIR)


@dataclass(frozen=True)
class RankedCard(Target):
    """The card of a stimulus with its letter; a `new` card has no place yet, a `chosen` card is being moved."""

    new: bool = False
    chosen: bool = False

    def paint(self, image: Image.Image, page: Page) -> None:
        page.shapes.fill(image, self.box, rounding(page), ACCENT if self.new else TINT if self.chosen else CARD)
        edge = ACCENT if self.new or self.chosen else EDGE
        page.shapes.frame(image, self.box, rounding(page), hair(page) * (3 if self.chosen else 2), edge)
        self._label(page, CARD if self.new else INK).paint(image, page)
        self._ring(image, page, CARD if self.new else INK)


class RankingScreen(Base):
    """The card of the stimulus just felt, and the row of all places, of which the first are taken.

    A card is inserted in the row where it is dragged to, and those behind it make room. Once all stimuli felt so far
    have a place, Next leads on to the next stimulus or, after the last, ends the trial. The key T feels the chosen one
    again.
    """

    def __init__(self, ask: Ask, form: Ranking, page: Page) -> None:
        self.form = form
        self.ranks = dict.fromkeys(form.stimuli, 0)
        self.show(ask.previous or {})
        self.new = form.new(self.ranks)
        self.shown = [name for name in form.stimuli if self.ranks[name] or name == self.new]
        self.chosen_card = self.new or min(self.shown, key=lambda name: self.ranks[name])
        self.moves: list[list[Any]] = []
        self._pressed_at: tuple[float, float] | None = None
        self._rank_before = 0
        all_felt = len(self.shown) == len(form.stimuli)
        left, right = back_and_next(page, "next" if all_felt else "ranking_next")
        hint = page.texts("ranking_hint") + ("   " + page.texts("ranking_again_hint") if form.again else "")
        super().__init__(trial_frame(page, ask, "ranking_prompt", hint, left, right), may_go_back=ask.may_go_back)
        self._place()

    def body(self) -> Iterator[Element]:
        yield self._progress
        yield from self._ends
        if self.new is not None and not self.ranks[self.new]:
            yield Slot("tray", self._tray)
        for number, box in enumerate(self._slots, start=1):
            yield Slot(f"{SLOT_NAME}{number}", box)
        for name in sorted(self.shown, key=lambda name: self.ranks[name]):
            yield self._card(name)
        if self.form.again:
            laid = fitted(self.page, self._again(self.chosen_card), self._button.width, self._button.height, STEPS)
            yield Button(AGAIN, self._button, laid=laid)

    def missing(self) -> Sequence[Missing]:
        return [(self._name(name), self._letter(name)) for name in self.shown if not self.ranks[name]]

    def complain(self, missing: Sequence[Missing], /, key: str = "please_place") -> None:
        super().complain(missing, key)
        self.chosen_card = self._of(missing[0][0])

    def value(self) -> dict[str, Any]:
        return {"answers": dict(self.ranks), "moves": self.moves}

    def show(self, answers: Mapping[str, Any]) -> None:
        self.ranks |= {name: int(rank) for name, rank in answers.items()}

    def go_on(self) -> None:
        following = self.form.new(self.ranks)
        if self.missing() or following is None:
            super().go_on()
        else:
            self.finish(go="try", feel=following)

    def chosen(self, name: str, /) -> None:
        if name == AGAIN:
            self.finish(go="try", feel=self.chosen_card)

    def typed(self, _name: str | None, text: str, /) -> None:
        if self.form.again and text.strip().lower() in TRY_KEYS:
            self.chosen(AGAIN)

    def pressed(self, name: str, event: Pressed) -> None:
        self._pressed_at = event.x, event.y
        if name.startswith(CARD_NAME):
            self.chosen_card = self._of(name)
            self._rank_before = self.ranks[self.chosen_card]
        elif name.startswith(SLOT_NAME) and self.new is not None and not self.ranks[self.new]:
            self._put(self.new, len(self.form.stimuli))
            self._note(self.new, 0)

    def dragged(self, name: str, event: Moved | Released) -> None:
        if not name.startswith(CARD_NAME):
            return
        card = self._of(name)
        if self._pressed_at is not None:
            x, y = self._pressed_at
            if max(abs(event.x - x), abs(event.y - y)) < self.page.metrics.mm(TAP_MM):
                return
            self._pressed_at = None
        if self._row.holds(min(max(event.x, self._row.left), self._row.right - 1), event.y):
            middles = [box.middle[0] for box in self._slots]
            self._put(card, 1 + min(range(len(middles)), key=lambda n: abs(middles[n] - event.x)))
        elif card == self.new:
            self._put(card, 0)
        if isinstance(event, Released):
            self._note(card, self._rank_before)

    def key(self, name: str | None, event: Key) -> bool:
        if event.name not in ("left", "right", "up", "down", "home", "end"):
            return False
        if name is None or not name.startswith(CARD_NAME):
            self.focus = name = self._name(self.chosen_card)
        card, last = self._of(name), len(self.form.stimuli)
        self.chosen_card, rank = card, self.ranks[card]
        right = rank + 1 if rank else last
        to = {"left": max(1, rank - 1), "right": right, "home": 1, "end": last, "down": rank or last}
        self._put(card, to.get(event.name, rank))
        self._note(card, rank)
        return True

    def move_focus(self, by: int, among: Sequence[str] | None = None) -> None:
        super().move_focus(by, among)
        if self.focus is not None and self.focus.startswith(CARD_NAME):
            self.chosen_card = self._of(self.focus)

    def _put(self, card: str, rank: int) -> None:
        """Give a card a rank, the first free one if it would leave a gap, or 0; the others close up around it."""
        others = [name for name in self.form.stimuli if self.ranks[name] and name != card]
        others.sort(key=lambda name: self.ranks[name])
        place = min(rank, len(others) + 1)
        order = others if place == 0 else [*others[: place - 1], card, *others[place - 1 :]]
        self.ranks = {name: order.index(name) + 1 if name in order else 0 for name in self.form.stimuli}
        self.notice = ()

    def _note(self, card: str, before: int) -> None:
        """Record the new rank of a card that had another rank before, and when."""
        if self.ranks[card] != before:
            self.moves.append([card, self.ranks[card], round(self.now_s, 3)])

    def _place(self) -> None:
        """Lay out the card to be placed, the row, its ends and the button, below one another in the body."""
        page, body, count = self.page, self.frame.body, len(self.form.stimuli)
        unit, gap = page.metrics.unit, max(page.metrics.unit(1.6), page.metrics.mm(NEAREST_TARGETS_MM) + 1)
        line, apart, button = round(1.5 * page.metrics.text(STEPS[0])), unit(4), page.metrics.target(11)
        explained = line if self.form.attribute.explanation is None else 3 * line
        below = 2 * line + explained + 2 * apart + (button + apart if self.form.again else 0)
        height = min(unit(TALLEST), (body.height - line - below - 2 * apart) // 2)
        width = min(unit(WIDEST), (body.width - (count - 1) * gap) // count)
        top = body.top + max(0, body.height - line - below - 2 * apart - 2 * height) // 3
        row_width = count * width + (count - 1) * gap
        left = body.left + (body.width - row_width) // 2
        self._line = Box(body.left, top, body.width, line)
        self._tray = Box(body.left + (body.width - width) // 2, self._line.bottom + apart, width, height)
        row_top = self._tray.bottom + apart
        self._slots = [Box(left + n * (width + gap), row_top, width, height) for n in range(count)]
        reach = unit(REACH)
        self._row = Box(left, row_top - min(reach, apart), row_width, height + min(reach, apart) + reach)
        wide = max(row_width, body.width * 2 // 3)
        ends = Box(body.left + (body.width - wide) // 2, row_top + height + apart // 2, wide, 2 * line)
        self._ends = tuple(self._texts(ends, explained - line if explained > line else 0))
        self._button = Box(
            body.left + (body.width - unit(90)) // 2, ends.bottom + explained - line + apart, unit(90), button
        )
        for name in self.form.stimuli:
            fitted(page, self._again(name), self._button.width, button, STEPS)

    def _texts(self, ends: Box, height: int) -> Iterator[Label]:
        """Yield the poles below the ends of the row, and the explanation below them."""
        page, attribute, half = self.page, self.form.attribute, (ends.width - self.page.metrics.unit(4)) // 2
        low, high = (
            fitted(page, page.say(pole), half, ends.height, STEPS, bold=True)
            for pole in (attribute.low, attribute.high)
        )
        yield Label("low", Box(ends.left, ends.top, half, ends.height), laid=low)
        yield Label("high", Box(ends.right - half, ends.top, half, ends.height), laid=high, align="right")
        if attribute.explanation is not None:
            box = Box(ends.left, ends.bottom, ends.width, height)
            laid = fitted(page, page.say(attribute.explanation), box.width, box.height, STEPS, even=True)
            yield Label("explanation", box, laid=laid, align="centre")

    @property
    def _progress(self) -> Label:
        """Return a label with how many stimuli have been felt, and what to do now."""
        texts, new = self.page.texts, self.new
        now = texts("ranking_all") if new is None or self.ranks[new] else texts("ranking_new", card=self._letter(new))
        felt = texts("ranking_felt", felt=len(self.shown), total=len(self.form.stimuli))
        laid = fitted(self.page, f"{felt}   {now}", self._line.width, self._line.height, STEPS)
        return Label("told", self._line, laid=laid, align="centre")

    def _card(self, name: str) -> RankedCard:
        rank = self.ranks[name]
        slot, within = (self._slots[rank - 1], f"{SLOT_NAME}{rank}") if rank else (self._tray, "tray")
        box = slot.grown(-max(1, self.page.metrics.mm(EDGE_MM)))
        laid = fitted(self.page, self._letter(name), box.width, box.height, (9.0, 7.0, *STEPS), bold=True)
        return RankedCard(
            self._name(name), box, within, laid=laid, new=not rank, chosen=name == self.chosen_card and bool(rank)
        )

    def _again(self, name: str) -> str:
        return self.page.texts("ranking_again", card=self._letter(name))

    def _name(self, name: str) -> str:
        return f"{CARD_NAME}{self.form.stimuli.index(name)}"

    def _of(self, name: str) -> str:
        return self.form.stimuli[int(name.removeprefix(CARD_NAME))]

    def _letter(self, name: str) -> str:
        """Return the letter on a card: A for the stimulus felt first."""
        return ascii_uppercase[self.form.stimuli.index(name)]


SCREEN = RankingScreen


def SPECIMEN(words: Wording) -> Specimen:
    """Return a specimen of six stimuli, of which the fifth is to be placed."""
    low, high, explanation = words.four[0]
    stimuli = tuple(Stimulus(id=str(number)) for number in range(1, 7))
    form = Ranking(tuple(s.id for s in stimuli), Attribute(low=low, high=high, explanation=explanation))
    trial = Trial(15, "1", False, stimuli[4], form, may_go_back=True, rest_before=False, stimuli=stimuli)
    return Specimen(Ask(form, trial, {"1": 3, "2": 1, "3": 4, "4": 2, "5": 0, "6": 0}))

"""The common behaviour of screens: one target per press, a focus for the keyboard, sheets, Next and Back.

Only the changes of a screen are painted: its elements are compared with those painted last.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from palpate.devices.window.geometry import Box, Placed
from palpate.devices.window.inputs import Input, Key, Moved, Pressed, Released, Typed
from palpate.devices.window.paint import GROUND
from palpate.devices.window.screen import Page
from palpate.devices.window.screens.elements import Element
from palpate.devices.window.screens.frame import Choice, Frame
from palpate.devices.window.screens.targets import Button, Target
from palpate.protocols.events import Reply, Samples

if TYPE_CHECKING:
    from PIL import Image

DECIDING = ("next", "agree")
DOUBLE_CLICK_S = 0.5
"""How long after its appearance a decisive button ignores presses, such as the second half of a double click."""
Missing = tuple[str, str]
"""(element to go to, its name) of an item that is not answered yet."""
Scene = tuple[Element, ...]


class Base:
    """A screen with a frame and a body; subclasses define the content and behaviour of the body.

    `sheet` is the current sheet of a long form; Next leads on from the last one only.
    """

    shows_held: type[Target] = Button
    """The kinds of targets that look pressed while they are held."""

    def __init__(self, frame: Frame, sheets: int = 1, may_go_back: bool = False) -> None:
        self.frame = frame
        self.page: Page = frame.page
        self._label = frame.label
        self.sheet = 0
        self.may_go_back = may_go_back
        self.reply: Reply | None = None
        self.side: str | None = None
        self.wants_rest = False
        self.focus: str | None = None
        self.by_key = False
        self.held: str | None = None
        self.notice: tuple[str, ...] = ()
        self.now_s = self.decided_from_s = 0.0
        self._painted = Painted()
        self._stale = True
        self.lay_out_on(sheets)

    # What a subclass gives.

    def body(self) -> Iterable[Element]:
        """Return the elements of the sheet."""
        return ()

    def missing(self) -> Sequence[Missing]:
        """Return what prevents the participant from leaving this sheet."""
        return ()

    def value(self) -> dict[str, Any]:
        """Return the reply's value without `seconds`."""
        return {}

    def samples(self) -> tuple[Samples, ...]:
        """Return the samples that were recorded on the screen."""
        return ()

    def pressed(self, name: str, event: Pressed) -> None:
        """Handle the press of a target, which then gets all pointer events until the release."""

    def dragged(self, name: str, event: Moved | Released) -> None:
        """Handle a move or release of the pointer after the press of a target."""

    def chosen(self, name: str, /) -> None:
        """Handle a button other than Next and Back."""

    def key(self, _name: str | None, _event: Key, /) -> bool:
        """Handle a key while a target has the focus; return whether it had an effect there."""
        return False

    def turned(self) -> None:
        """Handle the turn to another sheet."""

    def typed(self, name: str | None, text: str, /) -> None:
        """Handle text typed while a target has the focus."""

    def show(self, answers: Mapping[str, Any]) -> None:
        """Fill in answers given elsewhere."""

    # What the screen is to those who show it.

    def handle(self, event: Input) -> None:
        """Handle an input; ignore it once there is a reply."""
        if self.reply is not None:
            return
        self.now_s, self._stale = event.t_s, True
        match event:
            case Pressed():
                self._press(event)
            case Moved():
                if self.held is not None:
                    self.dragged(self.held, event)
            case Released():
                self._release(event)
            case Key():
                self._key(event)
            case Typed():
                self.typed(self.focus, event.text)

    def paint(self, image: Image.Image) -> tuple[Box, ...]:
        """Paint the changes onto the whole-screen picture, and return the painted boxes."""
        if not self._stale:
            return ()
        self._stale = False
        return self._painted.bring_up(image, self.scene(), self.page)

    def fill(self, value: Mapping[str, Any]) -> None:
        """Show the form as answered with a reply's value."""
        self.show(value.get("answers", {}))
        self._stale = True

    def so_far(self) -> Mapping[str, float]:
        """Return an empty mapping, as there are no lines."""
        return {}

    def repaint(self) -> None:
        """Paint everything at the next `paint`."""
        self._painted, self._stale = Painted(), True

    def placed(self) -> tuple[Placed, ...]:
        """Return every element's place now."""
        return tuple(placed for element in self.scene() for placed in element.placed(self.page))

    # How it is done.

    def scene(self) -> Scene:
        """Return every element as it looks now."""
        return tuple(self._looking(element) for element in self._elements())

    def finish(self, **beside: Any) -> None:
        """Make the reply, because the participant has finished."""
        value = {**beside, **self.value(), "seconds": round(self.now_s, 3)}
        self.reply = Reply(value, self.samples())

    def go_back(self) -> None:
        """Turn back a sheet, or leave for the trial before if allowed; the answers so far are recorded."""
        self.notice = ()
        if self.sheet > 0:
            self._turn(self.sheet - 1)
        elif self.may_go_back:
            answers = self.value().get("answers", {})
            so_far = {"so_far": answers} if any(answer not in ([], None) for answer in answers.values()) else {}
            self.reply = Reply({"go": "back", "seconds": round(self.now_s, 3), **so_far}, self.samples())

    def go_on(self) -> None:
        """Turn to the next sheet, or finish; if something is missing, say what."""
        if missing := self.missing():
            self.complain(missing)
        elif self.sheet < self.sheets - 1:
            self._turn(self.sheet + 1)
        else:
            self.finish()

    def complain(self, missing: Sequence[Missing], /, key: str = "please_answer") -> None:
        """Name what is missing, and focus on the first missing item."""
        names = [called for _, called in missing]
        fewer = (", ".join(names[:n]) + ", …" for n in range(len(names) - 1, 0, -1))
        self.notice = tuple(self.page.texts(key, missing=shown) for shown in (", ".join(names), *fewer))
        self.focus, self.by_key = missing[0][0], True

    def tell(self, key: str, **values: Any) -> None:
        """Show a notice at the foot of the screen."""
        self.notice = (self.page.texts(key, **values),)

    def buttons(self) -> Iterator[Button]:
        """Yield the buttons of the foot, in the order of the keyboard's focus."""
        for choice in (*reversed(self.frame.right), *self.frame.left):
            if choice.name != "back" or self.may_go_back or self.sheet > 0:
                yield self.frame.button(choice.name, on=self.is_on(choice.name))

    def is_on(self, name: str) -> bool:
        """Return whether a button is enabled now; a disabled one says why when it is pressed."""
        return name != "next" or not self.missing()

    def target_at(self, x: float, y: float) -> str | None:
        """Return the target under a point."""
        targets = [element for element in self._elements() if isinstance(element, Target) and element.box.holds(x, y)]
        return targets[-1].name if targets else None

    def move_focus(self, by: int, among: Sequence[str] | None = None) -> None:
        """Move the keyboard's focus on, cyclically."""
        stops = list(among) if among is not None else self.stops()
        if not stops:
            return
        start = stops.index(self.focus) if self.focus in stops else (-1 if by > 0 else len(stops))
        self.focus = stops[(start + by) % len(stops)]

    def stops(self) -> list[str]:
        """Return the targets of this sheet that the keyboard's focus stops at, in order."""
        return [element.name for element in self._elements() if element.stops]

    def _elements(self) -> Iterator[Element]:
        yield from self.frame.elements(self.notice)
        yield from self.body()
        yield from self.buttons()

    def _looking(self, element: Element) -> Element:
        if not isinstance(element, Target):
            return element
        if element.name == self.focus and self.by_key:
            element = replace(element, focused=True)
        held = element.name == self.held and isinstance(element, self.shows_held)
        return replace(element, held=True) if held else element

    def wait_a_moment(self) -> None:
        """Ignore the mouse for a moment, so that a new sheet is seen before it is pressed."""
        self.decided_from_s = self.now_s + DOUBLE_CLICK_S

    def lay_out_on(self, sheets: int) -> None:
        """Set the number of sheets; it is shown at the top with the current one."""
        self.sheets = sheets
        number = f"{self.sheet + 1} / {sheets}" if sheets > 1 else ""
        self.frame = replace(self.frame, label=" · ".join(filter(None, (self._label, number))))

    def _turn(self, sheet: int) -> None:
        """Turn to a sheet, and release anything held, because it belongs to the sheet before."""
        self.sheet, self.focus, self.held, self.notice = sheet, None, None, ()
        self.lay_out_on(self.sheets)
        self.turned()

    def _press(self, event: Pressed) -> None:
        if self.held is not None:
            return
        self.by_key = False
        self.held = self.target_at(event.x, event.y)
        if self.held in DECIDING and event.t_s < self.decided_from_s:
            self.held = None
        if self.held is not None:
            self.focus = self.held
            self.pressed(self.held, event)

    def _release(self, event: Released) -> None:
        """Handle a release: a button counts if it is released on it, or close by."""
        name, self.held = self.held, None
        if name is None:
            return
        self.dragged(name, event)
        button = next(
            (element for element in self._elements() if element.name == name and isinstance(element, Button)), None
        )
        if button is not None and button.box.grown(self.page.metrics.unit(3)).holds(event.x, event.y):
            self._use(name)

    def _use(self, name: str | None) -> None:
        if name == "next":
            self.go_on()
        elif name == "back":
            self.go_back()
        elif name == "rest":
            self.wants_rest, self.focus = True, None
        elif name is not None:
            self.chosen(name)

    def _key(self, event: Key) -> None:
        self.by_key = True
        on_button = self.focus in {element.name for element in self._elements() if isinstance(element, Button)}
        if event.name == "tab":
            self.move_focus(-1 if event.shift else 1)
        elif self.key(self.focus, event):
            return
        elif event.name in ("enter", "space") and on_button and self.focus is not None:
            self._use(self.focus)
        elif event.name == "enter":
            self._use(self.default_choice())
        elif event.name == "backspace":
            self.go_back()

    def default_choice(self) -> str | None:
        """Return the button for Enter, if any."""
        return self.frame.right[-1].name if self.frame.right else None


def back_and_next(page: Page, next_key: str = "next") -> tuple[tuple[Choice, ...], tuple[Choice, ...]]:
    """Return the usual buttons: Back on the left, Next on the right."""
    texts = page.texts
    return (Choice("back", texts("back")),), (Choice("next", texts(next_key), primary=True),)


@dataclass
class Painted:
    """The look of a screen when it was painted last; None before the first time."""

    scene: Scene | None = None

    def bring_up(self, image: Image.Image, scene: Scene, page: Page) -> tuple[Box, ...]:
        """Paint the differences, and return the painted boxes."""
        before, self.scene = self.scene, scene
        boxes = [page.metrics.screen] if before is None else gathered(changed(before, scene))
        for box in boxes:
            _paint(image, box.common(page.metrics.screen), scene, page)
        return tuple(boxes)


def changed(before: Scene, after: Scene) -> list[Box]:
    """Return the boxes where the two scenes differ."""
    same = set(before) & set(after)
    return [element.box for element in (*before, *after) if element not in same]


def gathered(boxes: Iterable[Box]) -> list[Box]:
    """Return the boxes, with overlapping ones joined."""
    apart: list[Box] = []
    for box in boxes:
        joined = box
        while near := [other for other in apart if other.overlaps(joined)]:
            apart = [other for other in apart if other not in near]
            for other in near:
                joined = joined.joined(other)
        apart.append(joined)
    return apart


def _paint(image: Image.Image, box: Box, scene: Scene, page: Page) -> None:
    """Repaint a part of the screen: all elements that reach into it, in order, clipped to it."""
    from PIL import Image

    part = Image.new("RGB", (box.width, box.height), GROUND)
    for element in scene:
        if element.box.overlaps(box):
            replace(element, box=element.box.moved(-box.left, -box.top)).paint(part, page)
    image.paste(part, (box.left, box.top))

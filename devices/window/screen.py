"""The interface of a screen, and the page for which screens are built."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from palpate.devices.window.fonts import Fonts
from palpate.devices.window.geometry import Box, Metrics, Placed
from palpate.devices.window.inputs import Input
from palpate.devices.window.paint import Shapes
from palpate.devices.window.texts import Texts
from palpate.protocols.events import Reply

if TYPE_CHECKING:
    from PIL import Image

SLIDER_MM = 127.0
"""Length of a rating line (thesis 3.3.3)."""


class Screen(Protocol):
    """A page that the participant sees: it handles inputs, keeps its state, and paints itself."""

    reply: Reply | None
    """The reply, once the participant has finished."""
    side: str | None
    """The current side, if there are sides to switch between."""
    wants_rest: bool
    """Whether the participant has requested a rest; the code that handles it resets it."""

    def handle(self, event: Input) -> None:
        """Handle an input; ignore it once there is a reply."""

    def paint(self, image: Image.Image) -> tuple[Box, ...]:
        """Paint the changes since the last call onto the whole-screen RGB picture, and return the painted boxes.

        The first call paints everything; without a change the result is ().
        """

    def repaint(self) -> None:
        """Paint everything at the next `paint`, because something else was visible meanwhile."""

    def scene(self) -> Sequence[object]:
        """Return all elements as they look now, to compare for changes. Raises WindowError if a text does not fit."""

    def placed(self) -> tuple[Placed, ...]:
        """Return the places of all elements now, for checks of the geometry."""

    def so_far(self) -> Mapping[str, float]:
        """Return the current values of its lines; {} on a screen without lines."""

    def fill(self, value: Mapping[str, Any]) -> None:
        """Show the form as answered with a reply's value."""


@dataclass(frozen=True)
class Page:
    """The common part of every screen of a session.

    `words` translates the study's own texts (empty: as written), `pages` are the texts of its pages by name
    (instructions), `total` is the number of trials and `length_mm` the length of a rating line. `hangul`: in fields
    Latin keys write Hangul, if nothing else composes it. `may_rest`: forms of a trial have a button to rest. `force_of`
    makes the forces of a door from a setting, if a screen draws them.
    """

    metrics: Metrics
    texts: Texts
    fonts: Fonts
    words: Mapping[str, str] = field(default_factory=dict)
    pages: Mapping[str, str] = field(default_factory=dict)
    title: str = ""
    total: int = 0
    length_mm: float = SLIDER_MM
    hangul: bool = False
    may_rest: bool = False
    force_of: Callable[[Mapping[str, float]], Sequence[float]] | None = None
    shapes: Shapes = field(default_factory=Shapes)

    def say(self, text: str) -> str:
        """Return a text of the study in the participant's language."""
        return self.words.get(" ".join(text.split()), text)

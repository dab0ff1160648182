"""The designer's work and its history, independent of windows and files."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import Literal

from palpate.devices.door.making import HIGHEST, LOWEST, NEUTRAL

Letter = Literal["A", "B"]
MOST_SMOOTHING_DEG = 5.0
"""Greatest smoothing of a profile."""
MOST_STEPS = 1000
"""Greatest number of steps that can be undone."""


@dataclass(frozen=True)
class Setting:
    """Seven wishes, 0 to 100, and the smoothing of the profile in degrees."""

    wish: tuple[float, ...]
    smoothing_deg: float = 0.0

    def wished(self, number: int, value: float) -> Setting:
        """Return the setting with one wish set to a whole number within its range."""
        put = float(round(min(max(value, LOWEST), HIGHEST)))
        return replace(self, wish=(*self.wish[:number], put, *self.wish[number + 1 :]))

    def smoothed(self, degrees: float) -> Setting:
        """Return the setting with another smoothing, in tenths of a degree."""
        return replace(self, smoothing_deg=round(min(max(degrees, 0.0), MOST_SMOOTHING_DEG), 1))


def neutral(count: int) -> Setting:
    """Return the setting with every wish in the middle."""
    return Setting((NEUTRAL,) * count)


@dataclass(frozen=True)
class Work:
    """A setting, or two that are compared; `on` is the one that is edited and played.

    `name` is the name of the design that was saved or opened last, `saved` its setting.
    """

    a: Setting
    b: Setting | None = None
    on: Letter = "A"
    name: str = ""
    saved: Setting | None = None

    @property
    def setting(self) -> Setting:
        """Return the edited setting."""
        return self.b if self.on == "B" and self.b is not None else self.a

    @property
    def other(self) -> Setting | None:
        """Return the other setting while two are compared, else None."""
        return None if self.b is None else self.a if self.on == "B" else self.b

    @property
    def untouched(self) -> bool:
        """Return whether nothing would be lost: everything is saved, or still at its initial value."""
        start = neutral(len(self.a.wish))
        return self.b is None and self.a in (start, self.saved)

    def put(self, setting: Setting) -> Work:
        """Return the work with the edited setting replaced."""
        return replace(self, b=setting) if self.on == "B" else replace(self, a=setting)

    def compared(self) -> Work:
        """Return the work with this setting as A and a copy of it as B."""
        return self if self.b is not None else replace(self, b=self.a, on="B")

    def switched(self, to: Letter) -> Work:
        """Return the work with the other setting edited and played."""
        return self if self.b is None else replace(self, on=to)

    def kept(self) -> Work:
        """Return the work with only the edited setting."""
        return replace(self, a=self.setting, b=None, on="A")


@dataclass
class History:
    """The current work, its earlier states, and undone ones. One gesture is one step, however far it moves."""

    now: Work
    past: list[Work] = field(default_factory=list)
    undone: list[Work] = field(default_factory=list)
    _gesture: Hashable = None

    def put(self, work: Work, gesture: Hashable = None) -> None:
        """Replace the work; steps of one gesture are undone as one."""
        if work == self.now:
            return
        if gesture is None or gesture != self._gesture:
            self.past = [*self.past[1 - MOST_STEPS :], self.now]
        self._gesture = gesture
        self.undone.clear()
        self.now = work

    def note(self, work: Work) -> None:
        """Replace the work after it was only named or saved, which cannot be undone."""
        self.now, self._gesture = work, None

    def undo(self) -> bool:
        """Undo one step; return whether there was one."""
        return self._step(self.past, self.undone)

    def redo(self) -> bool:
        """Redo one step; return whether there was one."""
        return self._step(self.undone, self.past)

    def _step(self, start: list[Work], end: list[Work]) -> bool:
        self._gesture = None
        if not start:
            return False
        end.append(self.now)
        self.now = start.pop()
        return True

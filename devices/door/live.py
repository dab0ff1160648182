"""A door that is remade from its wishes while it is felt: at most 20 times a second, and only after a change."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from palpate.protocols.events import NS

RATE_HZ = 20
PERIOD_NS = NS // RATE_HZ

W = TypeVar("W")
"""The type of a setting: {attribute: value} in a session, a Setting in the designer's window."""


@dataclass(frozen=True)
class Change(Generic[W]):
    """A new profile: the setting, when it was seen, how long it took to make, and when the door had it.

    `taken_ns` is None if the door did not change; `why` is then the refusal of the door or of its limits.
    """

    wish: W
    force_N: tuple[float, ...]
    seen_ns: int
    computed_ns: int
    taken_ns: int | None = None
    why: str = ""


@dataclass
class LiveDoor(Generic[W]):
    """A profile that follows the wishes; see palpate.devices.door.link.showing.Changes.

    `wish` returns the current setting, `force_N` makes a door of it, `initial_wish` is what the door plays already.
    `missed` counts the ticks of 50 ms that passed while the program was busy.
    """

    wish: Callable[[], W]
    force_N: Callable[[W], tuple[float, ...]]
    initial_wish: W
    stopped: Callable[[], bool] | None = None
    """Returns whether the participant is done; None if the door is done once it was brought back."""
    count_ns: Callable[[], int] = time.perf_counter_ns
    changes: list[Change[W]] = field(default_factory=list)
    ticks: int = 0
    missed: int = 0
    _last: W | None = None
    _due_ns: int | None = None
    _offered: Change[W] | None = None

    def newer(self, t_ns: int) -> Sequence[float] | None:
        """Return, at each tick, the door of a changed wish; else None."""
        if self._due_ns is None:
            self._due_ns = t_ns
        if t_ns < self._due_ns:
            return None
        late = (t_ns - self._due_ns) // PERIOD_NS
        self.ticks, self.missed = self.ticks + 1, self.missed + late
        self._due_ns += (late + 1) * PERIOD_NS
        wish = self.wish()
        if wish == (self.initial_wish if self._last is None else self._last):
            return None
        started_ns = self.count_ns()
        force_N = self.force_N(wish)
        self._last = wish
        self._offered = Change(wish, force_N, t_ns, t_ns + self.count_ns() - started_ns)
        return force_N

    def took(self, t_ns: int, why: str) -> None:
        """Record the outcome of the last change."""
        offered, self._offered = self._offered, None
        if offered is not None:
            self.changes.append(replace(offered, taken_ns=None if why else t_ns, why=why))

    def done(self) -> bool | None:
        """Return the answer of `stopped`, or None without it."""
        return None if self.stopped is None else self.stopped()

    def rests(self) -> None:
        """Record a pause of the door, so that its time does not count as missed ticks."""
        self._due_ns = None

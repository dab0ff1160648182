"""A door that is made anew from its wishes while it is felt: 20 times a second at most, and only where one changed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from palpate.protocols.events import NS

RATE_HZ = 20
PERIOD_NS = NS // RATE_HZ

W = TypeVar("W")
"""What is set: {attribute: value} in a session, a setting of the designer's window."""


@dataclass(frozen=True)
class Change(Generic[W]):
    """One new profile: what was set, when it was seen, how long it took to make, and when the door had it.

    `taken_ns` is None where the door stays as it was; `why` then says what the door or its limits said.
    """

    wish: W
    force_N: tuple[float, ...]
    seen_ns: int
    computed_ns: int
    taken_ns: int | None = None
    why: str = ""


@dataclass
class LiveDoor(Generic[W]):
    """The profile that follows the wishes; see palpate.devices.door.link.showing.Changes.

    `wish` gives what is set now, `force_N` makes a door of it, `initial_wish` is what the door plays already.
    `missed` counts the ticks of 50 ms that passed while something else kept the program.
    """

    wish: Callable[[], W]
    force_N: Callable[[W], tuple[float, ...]]
    initial_wish: W
    stopped: Callable[[], bool] | None = None
    """Whether the participant is done; None where the door is done once it was brought back."""
    count_ns: Callable[[], int] = time.perf_counter_ns
    changes: list[Change[W]] = field(default_factory=list)
    ticks: int = 0
    missed: int = 0
    _last: W | None = None
    _due_ns: int | None = None
    _offered: Change[W] | None = None

    def newer(self, t_ns: int) -> Sequence[float] | None:
        """Return, at each tick, the door of a wish that was changed; else None."""
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
        """Note what came of the change that was given last."""
        offered, self._offered = self._offered, None
        if offered is not None:
            self.changes.append(replace(offered, taken_ns=None if why else t_ns, why=why))

    def done(self) -> bool | None:
        """Return the answer of `stopped`, or None without it."""
        return None if self.stopped is None else self.stopped()

    def rests(self) -> None:
        """Note a pause of the door, so that its time does not count as missed ticks."""
        self._due_ns = None

"""A door that follows the sliders while it is felt: the form that stays on, and what the record keeps of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

from palpate.devices.desk import Desk
from palpate.devices.device import interleaved
from palpate.devices.door.live import RATE_HZ, Change, LiveDoor
from palpate.protocols.events import NS
from palpate.protocols.requests import Aside, Present, Samples
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG

SETTINGS, FORCES = "live_settings", "live_forces"
Setting = Mapping[str, float]
PAGE = "feel_now"


@runtime_checkable
class ShowsForms(Protocol):
    """A window that shows the form of a presentation while it is felt: palpate.devices.window.presenter."""

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show a page until `ready`, or until the experimenter did something."""

    def show_live(
        self, request: Present, desk: Desk, ready: Callable[[], bool], moved: Callable[[Setting, bool], None]
    ) -> Aside | None:
        """Show the request's form until `ready`; `moved` hears at every look where it stands, and of its Stop."""


@dataclass
class LiveForm:
    """The window's pages while a door is felt: instead of the page that says to feel it now, the sliders stay on."""

    window: ShowsForms
    request: Present
    _setting: dict[str, float] = field(default_factory=dict)
    _done: bool = False

    def __post_init__(self) -> None:
        form, wish = self.request.live_form, self.request.wish or {}
        self._setting = {} if form is None else {name: wish[name] for name in form.items()}

    def setting(self) -> Setting:
        """What is set now."""
        return dict(self._setting)

    def is_done(self) -> bool:
        """Whether the participant has stopped."""
        return self._done

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """The sliders in place of the page to feel; every other page as it is."""
        if key == PAGE:
            return self.window.show_live(self.request, desk, ready, self._moved)
        return self.window.wait_for(key, desk, ready)

    def _moved(self, setting: Setting, done: bool) -> None:
        self._setting.update(setting)
        self._done = self._done or done


@dataclass
class LiveRecord:
    """The streams of one presentation, taken piece by piece; both have one row for every profile.

    `live_settings`: when a setting was seen, made into a profile and taken by the door, in seconds since `t0_ns`,
    whether the door stayed as it was, and the setting. `live_forces`: its 621 forces. The first row is the profile
    that the door began with.
    """

    attributes: Sequence[str]
    begun_with: Setting
    force_N: Sequence[float]
    live: LiveDoor[Setting]
    t0_ns: int
    rows: int = 0

    def take(self) -> tuple[Samples, ...]:
        """What has come since the last time."""
        begun: Change[Setting] = Change(self.begun_with, tuple(self.force_N), self.t0_ns, self.t0_ns, self.t0_ns)
        changes, first = [begun, *self.live.changes][self.rows :], self.rows
        if not changes:
            return ()
        self.rows += len(changes)
        names, forces = list(self.attributes), [f"{n / POINTS_PER_DEG:g} deg" for n in range(POINTS)]
        channels = ("time", "made", "taken", "refused", *names)
        units = ("s", "s", "s", "yes/no", *["scale"] * len(names))
        settings = [value for change in changes for value in self._row(change)]
        made = [value for change in changes for value in (self._s(change.seen_ns), *change.force_N)]
        return (
            Samples(SETTINGS, channels, units, 0.0, self.t0_ns, interleaved(settings), first),
            Samples(FORCES, ("time", *forces), ("s", *["N"] * POINTS), 0.0, self.t0_ns, interleaved(made), first),
        )

    def summary(self) -> dict[str, Any]:
        """What the reply says: where the sliders were left, and how the stream went."""
        changes = self.live.changes
        refused = [change.why for change in changes if change.why]
        live = {"rate_hz": RATE_HZ, "ticks": self.live.ticks, "missed": self.live.missed, "changes": len(changes)}
        left_at = dict(changes[-1].wish if changes else self.begun_with)
        return {"left_at": left_at, "live": live | {"refused": len(refused), "why": refused[-1] if refused else ""}}

    def _row(self, change: Change[Setting]) -> list[float]:
        taken_ns = change.made_ns if change.taken_ns is None else change.taken_ns
        times = [self._s(t_ns) for t_ns in (change.seen_ns, change.made_ns, taken_ns)]
        return [*times, float(change.taken_ns is None), *(float(change.wish[name]) for name in self.attributes)]

    def _s(self, t_ns: int) -> float:
        return (t_ns - self.t0_ns) / NS

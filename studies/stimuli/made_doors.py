"""Doors made from wishes during a session, doors that follow the sliders while they are felt, and their record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from palpate.devices.desk import Desk, Pages
from palpate.devices.device import Presents, interleaved
from palpate.devices.door.live import RATE_HZ, Change, LiveDoor
from palpate.devices.door.making import HIGHEST, LOWEST, Doors, maker_for
from palpate.protocols.events import NS, Aside, Chunk, Fault, Present, Reply, Samples, WorldEvent
from palpate.protocols.forms import Sliders
from palpate.protocols.trial import Trial
from palpate.signals.doors.grid import POINTS, POINTS_PER_DEG
from palpate.studies.sessions.rig import RigError

if TYPE_CHECKING:
    from palpate.devices.door.link.showing import Changes


SETTINGS, FORCES = "live_settings", "live_forces"
Setting = Mapping[str, float]
PAGE = "feel_now"


@runtime_checkable
class ShowsForms(Protocol):
    """A window that shows the form of a presentation while it is felt: palpate.devices.window.presenter."""

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show a page until `ready`, or until the experimenter does something."""

    def show_live(
        self, request: Present, desk: Desk, ready: Callable[[], bool], moved: Callable[[Setting, bool], None]
    ) -> Aside | None:
        """Show the request's form until `ready`; call `moved` each frame with setting and whether Stop was pressed."""


@dataclass
class LiveForm:
    """Pages for the time that a door is felt: instead of the page that says to feel it now, the sliders stay."""

    window: ShowsForms
    request: Present
    _setting: dict[str, float] = field(default_factory=dict)
    _done: bool = False

    def __post_init__(self) -> None:
        form, wish = self.request.live_form, self.request.wish or {}
        self._setting = {} if form is None else {name: wish[name] for name in form.items()}

    def setting(self) -> Setting:
        """Return the present setting."""
        return dict(self._setting)

    def is_done(self) -> bool:
        """Return whether the participant has pressed Stop."""
        return self._done

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show the sliders in place of the page for feeling, every other page unchanged."""
        if key == PAGE:
            return self.window.show_live(self.request, desk, ready, self._moved)
        return self.window.wait_for(key, desk, ready)

    def _moved(self, setting: Setting, done: bool) -> None:
        self._setting.update(setting)
        self._done = self._done or done


@dataclass
class LiveRecord:
    """The streams of one presentation, taken piece by piece; both have one row per profile.

    `live_settings`: when a setting was seen, made into a profile and taken by the door, in seconds since `t0_ns`,
    whether the door stayed as it was, and the setting. `live_forces`: its 621 forces. The first row is the profile
    that the door began with.
    """

    attributes: Sequence[str]
    start: Setting
    force_N: Sequence[float]
    live: LiveDoor[Setting]
    t0_ns: int
    rows: int = 0

    def take(self) -> tuple[Samples, ...]:
        """Return the rows since the last call."""
        first_change: Change[Setting] = Change(self.start, tuple(self.force_N), self.t0_ns, self.t0_ns, self.t0_ns)
        changes, first = [first_change, *self.live.changes][self.rows :], self.rows
        if not changes:
            return ()
        self.rows += len(changes)
        names, forces = list(self.attributes), [f"{n / POINTS_PER_DEG:g} deg" for n in range(POINTS)]
        channels = ("time", "made", "taken", "refused", *names)
        units = ("s", "s", "s", "yes/no", *["scale"] * len(names))
        settings: list[float] = []
        for change in changes:
            taken_ns = change.computed_ns if change.taken_ns is None else change.taken_ns
            settings += [self._s(t_ns) for t_ns in (change.seen_ns, change.computed_ns, taken_ns)]
            settings += [float(change.taken_ns is None), *(float(change.wish[name]) for name in self.attributes)]
        made = [value for change in changes for value in (self._s(change.seen_ns), *change.force_N)]
        return (
            Samples(SETTINGS, channels, units, 0.0, self.t0_ns, interleaved(settings), first),
            Samples(FORCES, ("time", *forces), ("s", *["N"] * POINTS), 0.0, self.t0_ns, interleaved(made), first),
        )

    def summary(self) -> dict[str, Any]:
        """Return the reply's summary: the final setting of the sliders, and counts of the stream."""
        changes = self.live.changes
        refused = [change.why for change in changes if change.why]
        live = {"rate_hz": RATE_HZ, "ticks": self.live.ticks, "missed": self.live.missed, "changes": len(changes)}
        left_at = dict(changes[-1].wish if changes else self.start)
        return {"left_at": left_at, "live": live | {"refused": len(refused), "why": refused[-1] if refused else ""}}

    def _s(self, t_ns: int) -> float:
        return (t_ns - self.t0_ns) / NS


@dataclass(frozen=True)
class MadeDoors:
    """The doors of a lab's models, or of the shipped ones."""

    doors: Doors

    def check(self, trial: Trial) -> None:
        """Raise RigError unless doors can be made from the trial's attributes and their scale."""
        names, form = list(self.doors.maker.attributes), trial.form
        if not isinstance(form, Sliders) or sorted(form.items()) != sorted(names):
            found = "no sliders" if form is None else ", ".join(form.items())
            raise RigError(f"the door generator makes doors from {', '.join(names)}; found {found}")
        if (form.scale.low, form.scale.high) != (LOWEST, HIGHEST):
            found = f"{form.scale.low:g} to {form.scale.high:g}"
            raise RigError(f"the door generator needs a scale from 0 to 100; found {found}")

    def force_N(self, request: Present) -> tuple[float, ...]:
        """Return the 621 forces, in N, of a wish. Raises RigError without a wish, DoorDataError on an unusable one."""
        if request.wish is None:
            raise RigError(f"the door generator needs a wish to present, and was given {request.body()!r}")
        return self.doors.force_N(request.wish)

    def on_record(self, force_N: tuple[float, ...], reply: Reply) -> Reply:
        """Return the reply with the models that made the door and its forces, which outlast the models."""
        made = {"models": dict(self.doors.maker.identity), "force_N": list(force_N)}
        return replace(reply, value={**reply.value, "made": made})


@dataclass
class MadeDoorPresenter:
    """A presenter that plays doors from wishes and follows the sliders of a live form; its replies say what it played.

    `changes_from` hands the door what it follows, or None.
    """

    door: Presents
    made: MadeDoors
    changes_from: Callable[[Changes | None], None] = lambda _changes: None
    _following: tuple[Present, LiveForm, LiveRecord] | None = None

    def perform(self, request: Present, window: Pages, desk: Desk, now_ns: Callable[[], int]) -> WorldEvent:
        """Present as the door does. Raises RigError where a live form has no window to stay in."""
        if request.live_form is None:
            event = self.door.perform(request, window, desk, now_ns)
            return self.made.on_record(self.made.force_N(request), event) if isinstance(event, Reply) else event
        pages, record = self._followed(request, window, now_ns)
        event = self.door.perform(request, pages, desk, now_ns)
        if isinstance(event, Chunk):
            return replace(event, samples=(*event.samples, *record.take()))
        if isinstance(event, Reply):
            self._let_go()
            reply = self.made.on_record(tuple(record.force_N), event)
            return replace(reply, value={**reply.value, **record.summary()}, samples=(*reply.samples, *record.take()))
        if isinstance(event, Fault) or event.value.get("do") in {"repeat", "abort"}:
            self._let_go()
        return event

    def _followed(self, request: Present, window: Pages, now_ns: Callable[[], int]) -> tuple[LiveForm, LiveRecord]:
        """Return the form and the record that the door follows during this request."""
        if self._following is None or self._following[0] is not request:
            if not isinstance(window, ShowsForms):
                raise RigError("a live form stays on while the door is felt, and there is no window to show it in")
            pages = LiveForm(window, request)
            force_N = self.made.force_N(request)
            live = LiveDoor(pages.setting, self.made.doors.force_N, pages.setting(), pages.is_done)
            record = LiveRecord(list(pages.setting()), pages.setting(), force_N, live, now_ns())
            self._following = request, pages, record
            self.changes_from(live)
        return self._following[1:]

    def _let_go(self) -> None:
        self._following = None
        self.changes_from(None)


def made_doors(lab: Path | None) -> MadeDoors:
    """Return the doors that a lab's models make from wishes. Raises ModelFileError where a model cannot be read."""
    return MadeDoors(Doors(maker_for(lab)))

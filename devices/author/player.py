"""Play a profile on the door while the window stays responsive; every failure is reported and leaves the door at
rest.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from threading import Thread
from typing import Any, Protocol

from palpate.devices.desk import Desk, Prompt
from palpate.devices.device import DeviceError, DeviceFault, NowNs
from palpate.devices.door.link.limits import ProfileRefused
from palpate.devices.door.link.showing import Changes
from palpate.devices.door.link.simulator import DoorSimulator
from palpate.devices.door.link.telemetry import CHANNELS
from palpate.protocols.events import Aside, Chunk, Fault, Present, Reply
from palpate.protocols.study import Stimulus
from palpate.protocols.trial import Trial

ROW = struct.Struct(f"<{len(CHANNELS)}f")
ANGLE, TORQUE = CHANNELS.index("angle"), CHANNELS.index("torque")


class Screen(Protocol):
    """The screen that shows the work while the door plays."""

    def turn(self) -> None:
        """Handle the designer's inputs, and draw the work."""

    def door_is(self, state: str, problem: str = "") -> None:
        """Show the door's new state (a text key); `problem` is what a person has to repair and confirm."""

    def hand_at(self, place: tuple[float, float] | None) -> None:
        """Show the door's angle in degrees and the force in newtons at its handle."""


@dataclass(frozen=True)
class Played:
    """The end of a presentation: a text key, and the device's message if it failed."""

    key: str
    why: str = ""

    @property
    def wrong(self) -> bool:
        """Return whether the presentation failed."""
        return bool(self.why)


@dataclass
class OneDesk:
    """The desk of a designer who is both participant and experimenter: the main button confirms all prompts."""

    screen: Screen
    prompt: Prompt | None = None
    confirmed: bool = False
    leaving: bool = False

    def poll(self) -> Aside | None:
        """Return an action that ends the presentation once the window is closed."""
        return Aside({"do": "abort", "text": "the window is closed"}) if self.leaving else None

    def demand(self, prompt: Prompt | None) -> None:
        """Set the prompt; a new one discards the confirmation."""
        if prompt != self.prompt:
            self.prompt, self.confirmed = prompt, False

    def answer(self) -> float | bool | str | None:
        """Return True once the main button was pressed."""
        return True if self.confirmed else None

    def tell(self, state: Mapping[str, Any]) -> None:
        """Do nothing: the window gets the devices' states elsewhere."""


@dataclass
class InWindow:
    """The page while a device waits: the sliders, and the device's state beside them."""

    screen: Screen

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Keep the window responsive until `ready`."""
        if key == "feel_now":
            self.screen.door_is("playing")
        elif isinstance(desk, OneDesk) and desk.prompt is not None:
            self.screen.door_is("asking", desk.prompt.text)
        while (aside := desk.poll()) is None and not ready():
            self.screen.turn()
        return aside


@dataclass
class Seen:
    """The telemetry of one presentation, used only to show where the door is."""

    door: DoorSimulator
    now_ns: NowNs
    screen: Screen

    def start(self) -> None:
        """Start the door's telemetry."""
        self.door.start(self.now_ns)

    def due(self) -> bool:
        """Return False, because nothing is recorded; use the newest sample as the door's position."""
        with suppress(DeviceFault):  # Whoever presents sees it as well, and deals with it.
            blocks = [block.data for block in self.door.read(0.0)["telemetry"] if block.data]
            if blocks:
                last = ROW.unpack(blocks[-1][-ROW.size :])
                self.screen.hand_at((last[ANGLE], last[TORQUE] / self.door.setup.handle_radius_m))
        return False

    def take(self) -> Chunk:
        """Return an empty chunk, because nothing is recorded."""
        return Chunk({}, ())

    def fault(self) -> DeviceFault | None:
        """Return None, because failures show on the link."""
        return None

    def stop(self) -> Mapping[str, Any]:
        """Stop the door's telemetry, hide its position, and return an empty summary."""
        self.door.stop()
        self.screen.hand_at(None)
        return {}


@dataclass
class Player:
    """The door of a rig, or a twin. It is opened when it is played for the first time, and stays open."""

    door: DoorSimulator
    screen: Screen
    now_ns: NowNs
    desk: OneDesk = field(init=False)
    busy: bool = False
    opened: bool = False

    def __post_init__(self) -> None:
        self.desk = OneDesk(self.screen)
        self.door.recorder = lambda door, now_ns: Seen(door, now_ns, self.screen)

    @property
    def simulated(self) -> bool:
        """Return whether the door is a twin."""
        return self.door.by == "twin"

    def play(self, force_N: Sequence[float], name: str, changes: Changes | None = None) -> Played:
        """Play until the door was opened and brought back, or Stop; the window stays responsive, `changes` are felt."""
        if self.busy:
            return Played("door_busy", "busy")
        self.busy, self.desk.confirmed, self.door.changes = True, False, changes
        try:
            return self._played(force_N, name)
        finally:
            self.busy, self.door.changes = False, None
            self.desk.demand(None)
            self.screen.hand_at(None)
            self.screen.door_is("rest")

    def press(self) -> None:
        """Handle the main button while the door plays: stop, or confirm the prompt."""
        self.desk.confirmed = True

    def leave(self) -> None:
        """End the presentation, because the window is being closed."""
        self.desk.leaving = True

    def close(self) -> None:
        """Make the door safe and release it."""
        self.door.close()

    def _played(self, force_N: Sequence[float], name: str) -> Played:
        try:
            self.door.check(force_N, name)
            if not self.opened:
                # Connect in a thread of its own, so that the window does not stand still.
                failed: deque[BaseException] = deque()
                opening = Thread(target=self._opened_in_thread, args=(failed,), name="opening the door")
                self.screen.door_is("connecting")
                opening.start()
                while opening.is_alive():
                    self.screen.turn()
                opening.join()
                if failed:
                    raise failed[0]
                self.opened = True
            trial = Trial(1, "author", False, Stimulus(id=name), None, False, False)
            self.door.profile_for = lambda _request: force_N
            request, event = Present(trial), None
            while not isinstance(event, Reply | Fault):
                event = self.door.perform(request, InWindow(self.screen), self.desk, self.now_ns)
                if isinstance(event, Aside) and event.value.get("do") == "abort":
                    self.door.safe()
                    return Played("stopped")
            if isinstance(event, Fault):
                if event.value["what"] == "limit":  # Nothing is to be put right at the door.
                    self.door.unconfirmed.message = ""
                    return Played("door_refuses", str(event.value["message"]))
                return Played("door_failed", str(event.value["message"]))
            return Played({"brought_back": "played", "time_limit": "ended_late"}.get(event.value["ended"], "stopped"))
        except ProfileRefused as refused:
            return Played("door_refuses", str(refused))
        except DeviceError as error:
            return Played("door_none", str(error))

    def _opened_in_thread(self, failed: deque[BaseException]) -> None:
        try:
            self.door.open()
        except BaseException as error:
            failed.append(error)

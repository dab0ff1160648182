"""A request in progress that the experimenter may interrupt: its waiting, and its time without pauses.

After a fault, a person repairs the device and confirms that, before the request goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from palpate.devices.desk import Desk, Pages, Prompt
from palpate.devices.device import DeviceFault
from palpate.protocols.events import NS, Aside, Fault, Present, Request, Sense


@dataclass
class Act:
    """A request in progress; it continues with the same object after every aside."""

    request: Request
    started_ns: int
    paused_at_ns: int | None = None
    paused_ns: int = 0

    def seconds(self, t_ns: int) -> float:
        """Return the seconds since the request began, without pauses."""
        until = t_ns if self.paused_at_ns is None else self.paused_at_ns
        return round((until - self.started_ns - self.paused_ns) / NS, 3)

    def wait(
        self, key: str, window: Pages, desk: Desk, now_ns: Callable[[], int], ready: Callable[[], bool]
    ) -> Aside | None:
        """Show the page until `ready` (returns None) or an action of the experimenter; a pause stops the time."""
        aside = window.wait_for(key, desk, ready)
        if aside is not None:
            t_ns = now_ns()
            match aside.value.get("do"):
                case "pause" if self.paused_at_ns is None:
                    self.paused_at_ns = t_ns
                case "go_on" if self.paused_at_ns is not None:
                    self.paused_ns += t_ns - self.paused_at_ns
                    self.paused_at_ns = None
        return aside


def page_of(request: Request) -> str:
    """Return the page that the participant sees while the request is performed: the number of an interval, say."""
    if isinstance(request, Sense):
        return "recording"
    part = request.part if isinstance(request, Present) else None
    return "feel_now" if part is None or part.sides else f"interval {part.interval}"


def going_on(act: Act | None, request: Request, now_ns: Callable[[], int]) -> Act:
    """Return the act of this very request if it is in progress; else a new one."""
    return act if act is not None and act.request is request else Act(request, now_ns())


@dataclass
class UnconfirmedFault:
    """The last device fault whose repair the experimenter has not confirmed."""

    message: str = ""
    """Empty if there is no fault."""

    def record(self, fault: DeviceFault) -> Fault:
        """Return the fault as an event; from now on its repair must be confirmed first."""
        self.message = str(fault)
        return Fault({"device": fault.device, "what": fault.what, "message": str(fault)})

    def demand_confirmation(self, page: str, window: Pages, desk: Desk) -> Aside | None:
        """Show what has to be repaired and wait for the confirmation; return None at once without an open fault."""
        if not self.message:
            return None
        desk.demand(Prompt(f"{self.message.rstrip('.')}. Put it right, then confirm."))
        aside = window.wait_for(page, desk, lambda: desk.answer() is not None)
        if aside is None:
            desk.demand(None)
            self.message = ""
        return aside

"""A presenter for studies without a window: it waits where a page would be shown, and refuses questions."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from palpate.devices.desk import Desk, confirmed
from palpate.protocols.events import Aside, Confirm, Reply
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS
from palpate.studies.sessions.rig import RigError

if TYPE_CHECKING:
    from palpate.devices.window.presenter import Shown

TURN_S = 0.02


@dataclass
class Windowless:
    """A presenter (palpate.devices.window.presenter) that shows nothing."""

    clock: Callable[[], float] = time.monotonic
    rest: Callable[[float], None] = time.sleep
    on_side: Callable[[str], None] | None = None
    force_of: Callable[[Mapping[str, float]], Sequence[float]] | None = None
    description: Mapping[str, Any] = field(default_factory=dict)
    paused: bool = False

    def perform(self, request: Shown, desk: Desk, now_ns: Callable[[], int]) -> Reply | Aside:  # noqa: ARG002
        """Wait until a step of the set-up is confirmed. Raises RigError on other requests: nobody can answer."""
        if isinstance(request, Confirm) and request.text is not None:
            while self.paused or (reply := confirmed(request, desk)) is None:
                if (aside := desk.poll()) is not None:
                    return self._handle_aside(aside)
                self.rest(TURN_S)
            return reply
        raise RigError(f"there is no window to {request.body()['do']} in: `window` is missing in the study's needs")

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:  # noqa: ARG002
        """Wait until `ready` or until the experimenter does something; while paused, only for the latter."""
        while self.paused or not ready():
            if (aside := desk.poll()) is not None:
                return self._handle_aside(aside)
            self.rest(TURN_S)
        return None

    def show_answered(self, request: Shown, reply: Reply, seconds: float, desk: Desk) -> Aside | None:  # noqa: ARG002
        """Wait as long as the answered form would be shown."""
        until_s = self.clock() + seconds
        return self.wait_for("", desk, lambda: self.clock() >= until_s)

    def show_live(
        self,
        request: Shown,
        desk: Desk,  # noqa: ARG002
        ready: Callable[[], bool],  # noqa: ARG002
        moved: Callable[[Mapping[str, float], bool], None],  # noqa: ARG002
    ) -> Aside | None:
        """Raise RigError: a live form needs a participant who sees it."""
        raise RigError(f"there is no window to {request.body()['do']} in: `window` is missing in the study's needs")

    def finish(self, desk: Desk | None = None, page: str = "end") -> None:
        """Do nothing: there is no page to show."""

    def close(self) -> None:
        """Do nothing: there is no window to close."""

    def _handle_aside(self, aside: Aside) -> Aside:
        if aside.value["do"] in {"pause", "go_on"}:
            self.paused = aside.value["do"] == "pause"
        return aside


def asks_anything(study: Study) -> bool:
    """Return whether a participant reads or answers anything in a session of the study."""
    shown = study.opening or study.closing or study.instructions or study.rest or study.anchors
    return "window" in study.needs or TASKS[study.task].asks or bool(shown)

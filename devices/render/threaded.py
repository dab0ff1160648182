"""The loop on a thread of this process, for devices that were opened here."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from devices.render.loop import Loop
from devices.render.priority import in_front, undisturbed

NEVER = 2**62
GONE_S = 5.0


@dataclass
class Threaded:
    """Runs a loop until `end`; what it failed of is raised there. `facts` say with which priority."""

    loop: Loop
    real_time: bool = False
    facts: Mapping[str, str] = field(default_factory=dict)
    _error: BaseException | None = None
    _ending: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to play."""
        self._ending.clear()
        self._thread = threading.Thread(target=self._run, name="renders", daemon=True)
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether it plays; not any more where a device failed."""
        return self._thread is not None and self._thread.is_alive()

    def end(self) -> None:
        """Stop playing. Raises what the loop failed of: DeviceFault."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(GONE_S)
        self._thread = None
        error, self._error = self._error, None
        if error is not None:
            raise error

    def record(self) -> Mapping[str, Any]:
        """Deadlines so far, as JSON data."""
        return {"ready": self.loop.ready.record(), "woken": self.loop.woken.record(), **self.facts}

    def _run(self) -> None:
        try:
            with undisturbed():
                self.facts = in_front(self.real_time)
                self.loop.run(NEVER, self._ending.is_set)
        except BaseException as error:
            self._error = error

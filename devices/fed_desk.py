"""A desk that tells devices at every poll that the session is alive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.devices.desk import Desk, Prompt
from palpate.protocols.events import Aside


@dataclass(frozen=True)
class FedDesk:
    """The experimenter's desk; windows and devices poll it in every frame, so a session that hangs feeds nobody."""

    desk: Desk
    feed: Callable[[], None]

    def poll(self) -> Aside | None:
        """Feed the devices, and return the experimenter's next action."""
        self.feed()
        return self.desk.poll()

    def demand(self, prompt: Prompt | None) -> None:
        """Show a prompt, or remove the current one."""
        self.desk.demand(prompt)

    def answer(self) -> float | bool | str | None:
        """Return the answer to the prompt, if there is one."""
        return self.desk.answer()

    def tell(self, state: Mapping[str, Any]) -> None:
        """Show the state of a window or device."""
        self.desk.tell(state)

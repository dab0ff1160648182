"""The participant's side of a session: requests become screens, and screens become replies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from palpate.devices.desk import Desk
from palpate.protocols.events import Aside, Ask, Confirm, Instruct, Present, Reply, Rest

Shown = Ask | Instruct | Rest | Confirm | Present
PAUSE, END = "pause", "end"


class Presenter(Protocol):
    """A presenter, which puts requests before a participant."""

    description: Mapping[str, Any]
    """For the ledger: what the window is and what it says."""
    on_side: Callable[[str], None] | None
    """Told which side is on, where a screen has sides: when it appears, and when the participant switches."""
    force_of: Callable[[Mapping[str, float]], Sequence[float]] | None
    """Makes the forces that a live form draws; None where nothing is made here."""

    def perform(self, request: Shown, desk: Desk, now_ns: Callable[[], int]) -> Reply | Aside:
        """Show the request's screen until it is answered, or until the experimenter does something.

        Called again with the same request it goes on where it was; with another, the old screen is forgotten.
        Raises WindowError if the window can no longer be used, or if the calibration is not confirmed.
        """

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show the page of a text key until `ready` (None), or until the experimenter does something.

        While the session is paused, the pause page is shown and `ready` is not called.
        """

    def show_answered(self, request: Shown, reply: Reply, seconds: float, desk: Desk) -> Aside | None:
        """Show the request's screen filled with the reply, so long; called again it goes on with the rest of it."""

    def show_live(
        self,
        request: Present,
        desk: Desk,
        ready: Callable[[], bool],
        moved: Callable[[Mapping[str, float], bool], None],
    ) -> Aside | None:
        """Show the form that is felt until `ready` (None), or until the experimenter did something.

        At every look `moved` is given where the lines stand, and whether the participant pressed Stop.
        """

    def finish(self, desk: Desk | None = None, page: str = END) -> None:
        """Show the last page until the experimenter confirms at the desk; some seconds at most."""

    def close(self) -> None:
        """Give the screen back."""

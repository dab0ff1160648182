"""The participant's side of a session: requests are shown as screens, which give replies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from palpate.devices.desk import Desk
from palpate.protocols.events import Aside, Ask, Confirm, Instruct, Present, Reply, Rest

Shown = Ask | Instruct | Rest | Confirm | Present
PAUSE, END = "pause", "end"


class Presenter(Protocol):
    """A presenter, which shows requests to a participant."""

    description: Mapping[str, Any]
    """For the ledger: a description of the window and its texts."""
    on_side: Callable[[str], None] | None
    """Called with the current side, for screens with sides: when the screen appears, and at every switch."""
    force_of: Callable[[Mapping[str, float]], Sequence[float]] | None
    """Makes the forces that a live form draws; None if no door is made here."""

    def perform(self, request: Shown, desk: Desk, now_ns: Callable[[], int]) -> Reply | Aside:
        """Show the request's screen until it is answered, or until an action of the experimenter.

        Called again with the same request it continues; with another one, the old screen is dropped. Raises WindowError
        if the window can no longer be used, or if the calibration is not confirmed.
        """

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show the page of a text key until `ready` (returns None), or until an action of the experimenter.

        While the session is paused, the pause page is shown and `ready` is not called.
        """

    def show_answered(self, request: Shown, reply: Reply, seconds: float, desk: Desk) -> Aside | None:
        """Show the request's screen filled with the reply for some seconds; called again, for the rest of them."""

    def show_live(
        self,
        request: Present,
        desk: Desk,
        ready: Callable[[], bool],
        moved: Callable[[Mapping[str, float], bool], None],
    ) -> Aside | None:
        """Show the live form until `ready` (returns None), or until an action of the experimenter.

        At every turn `moved` is called with the lines' values, and whether the participant pressed Stop.
        """

    def finish(self, desk: Desk | None = None, page: str = END) -> None:
        """Show the last page until the experimenter confirms at the desk, for a limited time."""

    def close(self) -> None:
        """Close the window."""

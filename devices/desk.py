"""The experimenter's side for windows and devices: prompts to a person, and that person's actions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from palpate.protocols.events import Aside, Confirm, Reply


@dataclass(frozen=True)
class Prompt:
    """A prompt for the experimenter: a confirmation, or a number that may have a default.

    With `codes`, a scanned barcode is an answer too, by its text.
    """

    text: str
    kind: Literal["confirm", "number"] = "confirm"
    default: float | None = None
    codes: bool = False


def confirmed(request: Confirm, desk: Desk) -> Reply | None:
    """Prompt for a step of the setup, and return the reply once it is confirmed."""
    desk.demand(Prompt(f"{request.what.capitalize()}: {request.text}"))
    if desk.answer() is None:
        return None
    desk.demand(None)
    return Reply({"confirmed": True})


class Desk(Protocol):
    """The experimenter's desk. Every method returns at once; only the main thread calls them."""

    def poll(self) -> Aside | None:
        """Return the experimenter's next action since the last poll, or None.

        Raises palpate.studies.sessions.interrupts.Interrupted if the experimenter ends the session.
        """

    def demand(self, prompt: Prompt | None) -> None:
        """Show a prompt to the experimenter, or remove the current one; an equal one stays unchanged."""

    def answer(self) -> float | bool | str | None:
        """Return the answer to the prompt: True once confirmed, a number or code once entered, None until then."""

    def tell(self, state: Mapping[str, Any]) -> None:
        """Show the state of a window or device; given keys replace earlier ones, None removes a key."""


class Pages(Protocol):
    """The pages that the participant sees while the program waits for something else."""

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show the page of that text key until `ready` (returns None), or until an action of the experimenter."""

"""The experimenter's side, as the window and the devices see it: demands put to a person, and what that person did."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from palpate.protocols.events import Aside, Confirm, Reply


@dataclass(frozen=True)
class Prompt:
    """A demand on the experimenter: a confirmation, or a number that may have a default.

    With `codes`, a barcode that is scanned answers as well, by its text.
    """

    text: str
    kind: Literal["confirm", "number"] = "confirm"
    default: float | None = None
    codes: bool = False


def confirmed(request: Confirm, desk: Desk) -> Reply | None:
    """Demand the step of setting up; the reply once it is confirmed."""
    desk.demand(Prompt(f"{request.what.capitalize()}: {request.text}"))
    if desk.answer() is None:
        return None
    desk.demand(None)
    return Reply({"confirmed": True})


class Desk(Protocol):
    """The experimenter's desk. Every method returns at once; only the main thread calls them."""

    def poll(self) -> Aside | None:
        """Return the experimenter's next action since the last poll, or None.

        Raise palpate.studies.sessions.interrupts.Interrupted where the experimenter ends the session.
        """

    def demand(self, prompt: Prompt | None) -> None:
        """Put a demand before the experimenter, or take the standing one away; an equal one stays as it stands."""

    def answer(self) -> float | bool | str | None:
        """Return the answer to the prompt: True once confirmed, a number or a code once given, None until then."""

    def tell(self, state: Mapping[str, Any]) -> None:
        """Show the state of a window or device; given keys replace earlier ones, None removes one."""


class Pages(Protocol):
    """The pages that the participant sees while something else is waited for."""

    def wait_for(self, key: str, desk: Desk, ready: Callable[[], bool]) -> Aside | None:
        """Show the page of that text key until `ready` (None), or until the experimenter did something."""

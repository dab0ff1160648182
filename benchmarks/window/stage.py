"""A process of its own with the real window, controlled through pipes: `python -m` this module.

It reads (name, ...) messages from its input and answers on its output; see `Stage` in benchmarks.window.stagehand.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from benchmarks.window.link import Link, Message, send
from palpate.devices.desk import Prompt
from palpate.devices.window.calibration import Calibration
from palpate.devices.window.presenter import Presenter
from palpate.devices.window.presenter_window import WindowPresenter, open_presenter
from palpate.protocols.events import Aside
from palpate.protocols.plan import Plan
from palpate.protocols.study import Study

LOOKS_AFTER = 2
"""Frames of the window between a request to look and the look, so that earlier inputs are painted by then."""


@dataclass(frozen=True)
class Setting:
    """The settings of the window; if there is a plan, all its forms are laid out first."""

    study: Study
    calibration: Calibration
    language: str = "en"
    folder: Path = Path()
    fullscreen: bool = False
    pages: Mapping[str, str] = field(default_factory=dict)
    plan: Plan | None = None


@dataclass
class RemoteDesk:
    """A desk that is driven from the other end of the pipe."""

    link: Link
    out: IO[bytes]
    presenter: WindowPresenter | None = None
    prompt: Prompt | None = None
    answered: float | bool | None = None
    ready: bool = False
    asides: deque[Aside] = field(default_factory=deque)
    looks: deque[tuple[int, bool]] = field(default_factory=deque)
    sides_shown: list[str] = field(default_factory=list)

    def poll(self) -> Aside | None:
        """Read the received messages, and answer the looks that are due."""
        while not self.link.inbox.empty():
            if (message := self.link.inbox.get()) is None:
                raise SystemExit(0)
            self.take(message)
        for _ in range(len(self.looks)):
            left, painted = self.looks.popleft()
            if left > 0:
                self.looks.append((left - 1, painted))
            else:
                send(self.out, "seen", self.look(painted))
        return self.asides.popleft() if self.asides else None

    def take(self, message: Message) -> None:
        """Handle one of the messages that may come during a performance."""
        match message:
            case ("aside", value):
                self.asides.append(Aside(value))
            case ("give", value):
                self.answered = value
            case ("ready",):
                self.ready = True
            case ("look", painted):
                self.looks.append((LOOKS_AFTER, painted))
            case _:
                raise ValueError(f"{message[0]!r} cannot be done while something is performed")

    def look(self, painted: bool) -> dict[str, Any]:
        """Return what is shown to the participant now, with the painted picture if `painted`."""
        on = None if self.presenter is None else self.presenter.on
        return {
            "on": None if on is None else on.name,
            "placed": () if on is None else on.screen.placed(),
            "picture": None if self.presenter is None or not painted else self.presenter.picture.copy(),
            "seconds": 0.0 if on is None else on.seconds(),
            "prompt": self.prompt,
            "sides": list(self.sides_shown),
        }

    def demand(self, prompt: Prompt | None) -> None:
        """Set the demand; a new one discards the earlier answer."""
        if prompt != self.prompt:
            self.prompt, self.answered = prompt, None

    def answer(self) -> float | bool | None:
        """Return the answer given to the present demand."""
        return self.answered

    def tell(self, state: Mapping[str, Any]) -> None:
        """Send what is shown to the other process."""
        send(self.out, "shown", dict(state))


def serve(desk: RemoteDesk, presenter: Presenter, now_ns: Callable[[], int]) -> None:
    """Handle one message after another until the pipe is closed."""
    request: Any = None
    while (message := desk.link.inbox.get()) is not None:
        match message:
            case ("perform", request):
                send(desk.out, "done", presenter.perform(request, desk, now_ns))
            case ("perform again",):
                send(desk.out, "done", presenter.perform(request, desk, now_ns))
            case ("wait for", key):
                desk.ready = False
                send(desk.out, "done", presenter.wait_for(key, desk, lambda: desk.ready))
            case ("show answered", request, reply, seconds):
                send(desk.out, "done", presenter.show_answered(request, reply, seconds, desk))
            case ("finish",):
                presenter.finish(desk)
                send(desk.out, "done", None)
            case _:
                desk.take(message)


def main() -> None:
    """Open the window that the first message describes and serve it; an error is sent and ends the process."""
    out = sys.stdout.buffer
    sys.stdout = sys.stderr
    desk = RemoteDesk(Link.from_input(), out)
    if (first := desk.link.inbox.get()) is None:
        return
    setting: Setting = first[1]
    presenter: Presenter | None = None
    try:
        presenter = open_presenter(
            setting.study, setting.calibration, setting.language, setting.folder,
            fullscreen=setting.fullscreen, pages=setting.pages, plan=setting.plan,
        )  # fmt: skip
        desk.presenter = presenter if isinstance(presenter, WindowPresenter) else None
        presenter.on_side = desk.sides_shown.append
        send(out, "open", dict(presenter.description))
        serve(desk, presenter, time.monotonic_ns)
    except ValueError as error:
        send(out, "failed", f"{type(error).__name__}: {error}")
    finally:
        if presenter is not None:
            presenter.close()


if __name__ == "__main__":
    main()

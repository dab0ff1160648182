"""The two threads of a link in real time: one reads the port, one beats the heart."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from palpate.devices.door.link.link import Link
from palpate.devices.door.link.ports import WAIT_S

BEAT_S = 0.010
ENDS_S = 2.0


@dataclass
class Threads:
    """Runs a link until it is ended."""

    link: Link
    ending: threading.Event = field(default_factory=threading.Event)
    running: list[threading.Thread] = field(default_factory=list)

    def start(self) -> None:
        """From now on the link is read and beats by itself."""
        self.link.threaded = True
        for work in (self._read, self._beat):
            thread = threading.Thread(target=work, name=f"{self.link.name} {work.__name__[1:]}s", daemon=True)
            self.running.append(thread)
            thread.start()

    def end(self) -> None:
        """End both; afterwards nobody reads the port."""
        self.ending.set()
        for thread in self.running:
            if thread is not threading.current_thread():
                thread.join(ENDS_S)
        self.running.clear()

    def _read(self) -> None:
        with self._lost_where_it_fails():
            while not self.ending.is_set() and self.link.broken is None:
                self.link.pump(WAIT_S)

    def _beat(self) -> None:
        with self._lost_where_it_fails():
            while not self.ending.wait(BEAT_S) and self.link.broken is None:
                self.link.beat()

    @contextmanager
    def _lost_where_it_fails(self) -> Iterator[None]:
        """A driver may raise what is no OSError, as pyserial does where its port was closed: the line is gone then."""
        try:
            yield
        except Exception as error:
            self.link.lose(error)

"""The cases of the door models, the keyswitch, the designer's window and the live door."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.doors import designer_window, keyswitch, live_door, models
from palpate.protocols.bench import Case


def cases(quick: bool) -> Iterator[Case]:
    """Yield every case of this area."""
    yield from models.cases(quick)
    yield from keyswitch.cases(quick)
    yield from designer_window.cases(quick)
    yield from live_door.cases(quick)

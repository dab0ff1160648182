"""What the loop cannot help: time that the host took away, and time that other programs had the processor."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

STAT, SCHEDULED = Path("/proc/stat"), Path("/proc/thread-self/schedstat")
STEAL = 8
"""The field of the line `cpu`, its name counted, that holds the ticks a hypervisor gave to others (proc(5))."""


@dataclass(frozen=True)
class Outside:
    """Seconds since the machine was started, None where the system does not tell.

    `stolen_s` is of all processors together, in ticks of usually 10 ms; `waited_s` of the calling thread: it could have
    run and was not let in.
    """

    stolen_s: float | None
    waited_s: float | None

    def since(self, before: Outside) -> dict[str, float | None]:
        """What has been added, as a record keeps it."""
        return {
            "stolen_s": _less(self.stolen_s, before.stolen_s), "waited_s": _less(self.waited_s, before.waited_s),
        }  # fmt: skip


def outside(stat: Path = STAT, scheduled: Path = SCHEDULED) -> Outside:
    """Now, for the calling thread."""
    stolen = waited = None
    with suppress(OSError, ValueError, IndexError, AttributeError):
        stolen = int(stat.read_text(encoding="ascii").split(maxsplit=STEAL + 1)[STEAL]) / os.sysconf("SC_CLK_TCK")
    with suppress(OSError, ValueError, IndexError):
        waited = int(scheduled.read_text(encoding="ascii").split()[1]) * 1e-9
    return Outside(stolen, waited)


def _less(after: float | None, before: float | None) -> float | None:
    return None if after is None or before is None else round(after - before, 4)

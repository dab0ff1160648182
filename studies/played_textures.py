"""A study's virtual texture played for a simulated hand, by the renderer's own loop, and compared with the real one."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studies.felt_alike import alike
from studies.renderings import MET, SEED, Rendered, told_of
from studies.rig import RigError

if TYPE_CHECKING:
    from devices.render.voice import Voice

Array = NDArray[np.float64]
COLUMNS = ("acceleration_m_s2", "speed_mm_s", "force_N")


def rendered(voice: Voice, card: Path, felt: Array, friction: float | None) -> Rendered:
    """Play a voice for the hand of `felt` (3, n), and compare; `friction` None: there is nothing to compare with."""
    from devices.render.hands import Scripted
    from devices.render.loop import Loop
    from devices.render.pace import AtOnce
    from devices.render.sinks import Kept

    sink, hand = Kept(), Scripted(felt[1].tolist(), felt[2].tolist())
    loop = Loop(voice, hand, sink, AtOnce())
    loop.run(len(hand) - 1)  # one more was made as it began
    found = None if friction is None else alike(felt[0], np.array(sink.samples), felt[1:], friction)
    late = {"steps": loop.made, "late": loop.ready.late, "underruns": 0, "clock": "virtual"}
    met = {name: getattr(voice.tally, name) for name in MET}
    how = {"runtime": voice.runs.runtime, "seed": SEED, "deadlines": late, "met": met}
    return Rendered({**told_of(card, voice.card), **how}, found)


def read_felt(file: Path) -> Array:
    """(3, n) at 1 kHz of a file with the columns t_s and COLUMNS. Raises RigError."""
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    try:
        found = np.array([[float(row[name]) for row in rows] for name in COLUMNS])
    except (KeyError, TypeError, ValueError) as error:
        raise RigError(f"{file}: numbers in the columns {', '.join(COLUMNS)} are expected ({error})") from None
    if not found.size or not np.isfinite(found).all():
        raise RigError(f"{file}: {len(rows)} rows; rows of finite numbers are expected")
    return found

"""Ledgers of texture_capture as a session leaves them, of several textures of made-up signals."""

import numpy as np

from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read
from tests.analysis.streams.ledgers import DOOR, Written, block, block_description
from tests.modeling.textures.textures_for_tests import vibration

WRENCH = {"channels": ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), "units": ("N",) * 3 + ("N m",) * 3}
AXES = {"channels": ("ax", "ay", "az"), "units": ("m/s^2",) * 3}
PLACE = {"channels": ("x", "y", "z", "seen"), "units": ("mm",) * 3 + ("1",)}
GRAVITY = np.array([0, 0, 9.81])
CHUNK_S = 0.5
"""As recorders write: acceleration and force lie in the file, positions are small enough to be kept."""


def streams(seed, seconds, first_s, press=1.0, seen_s=np.inf):
    """The streams of one exploration in chunks: a list of [(block, what the recorder says of it)].

    The tracker sees the marker for the first `seen_s`.
    """
    t = np.arange(round(120 * seconds)) / 120
    place = np.stack([40 * np.sin(3 * t), 40 * np.cos(3 * t), 0 * t, t < seen_s], axis=1)
    felt = np.stack([vibration(round(3000 * seconds), seed + axis) for axis in range(3)], axis=1) + GRAVITY
    force = 1.5 + 0.3 * np.sin(np.arange(round(8000 * seconds)) / 9000)
    force = press * force
    wrench = np.stack([0 * force, 0 * force, force, 0 * force, 0 * force, 0 * force], axis=1)
    kinds = (("tool_acceleration", felt, 3000, AXES), ("tool_force", wrench, 8000, WRENCH),
             ("tool_position", place, 120, PLACE))  # fmt: skip
    for chunk in range(round(seconds / CHUNK_S)):
        pieces = []
        for name, rows, rate_hz, form in kinds:
            a, b = (round(k * CHUNK_S * rate_hz) for k in (chunk, chunk + 1))
            pieces.append(
                (block(name, rows[a:b], rate_hz, a, first_s + a / rate_hz, **form), block_description(a, b - a))
            )
        yield pieces


def capture(written, trial, stimulus, seconds=6.0, seed=None, as_="captured", press=1.0, seen_s=np.inf):
    """One trial, whose streams begin where its number says."""
    written.trial, written.attempt = trial, 1
    written.note("trial_started", {"stimulus": stimulus, "block": "main"})
    written.ask_for("sense")
    for pieces in streams(trial if seed is None else seed, seconds, 100.0 * trial, press, seen_s):
        written.chunk(*pieces)
    written.done()
    written.end(as_)


def session(lab, participant, captures, rig=None):
    """A session's ledger with these captures: keyword arguments of `capture`. `rig`: of the header, twins without."""
    path = lab / "sessions" / f"texture_capture_{participant}_s1.sqlite"
    path.parent.mkdir(parents=True, exist_ok=True)
    written = Written(path)
    for number, changes in enumerate(captures, start=1):
        capture(written, **{"trial": number, **changes})
    header = read(DOOR).header
    stimuli = [
        {"id": f"T0{n}", "columns": {"label": f"wood {n} of 9", "class": "wood" if n < 3 else "foam"}}
        for n in range(1, 10)
    ]
    header = {**header, **({"rig": rig} if rig else {})}
    header = {**header, "participant": participant, "study": {**header["study"], "stimuli": stimuli}}
    create(path, header, {"at": "2026-01-01T00:00:00+00:00"})
    ledger = open_for_append(path, {"at": "2026-01-01T00:00:00+00:00"})
    try:
        for event in written.events:
            ledger.append(event)
    finally:
        ledger.close({"at": "2026-01-01T00:00:00+00:00", "because": "complete"})
    return path

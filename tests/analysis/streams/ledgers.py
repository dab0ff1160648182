"""Ledgers of sessions that recorded streams in every way that one can: written by the product's own ledger."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.protocols.canonical import canonical
from palpate.protocols.events import NS, Event, Samples
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read

RECORDED = Path(__file__).parents[2] / "recorded" / "ten"
DOOR = RECORDED / "door_capture_P001_s1.sqlite"


@dataclass
class Written:
    """A session's ledger in the making; times in seconds."""

    path: Path
    events: list[Event] = field(default_factory=list)
    trial: int | None = None
    attempt: int | None = None
    t_ns: int = 0

    def note(self, kind, body, samples=(), t_s=None):
        self.t_ns = self.t_ns if t_s is None else round(t_s * NS)
        seq = 1 + len(self.events)
        self.events.append(Event(seq, self.t_ns, kind, canonical(body), self.trial, self.attempt, tuple(samples)))

    def begin(self, trial, attempt=1, t_s=None):
        self.trial, self.attempt = trial, attempt
        self.note("trial_started", {"stimulus": "K8", "block": "main"}, t_s=t_s)
        self.ask_for("present")
        self.note("reply", {"presented": True})
        self.ask_for("sense")

    def ask_for(self, do):
        request = {"form": "sliders", "items": [], "back": False, "previous": None}
        given = {"present": {"stimulus": "K8"}, "sense": {"device": "d", "seconds": 1.0}, "ask": request}
        self.note("request", {"do": do, **given[do]})

    def end(self, as_="captured"):
        if as_ == "answered":
            self.ask_for("ask")
            self.note("reply", {"answers": {}})
        self.note("trial_ended", {"as": as_})

    def experimenter(self, **body):
        self.note("experimenter", body)

    def chunk(self, *pieces):
        """(Samples, description) of each stream."""
        streams = {block.stream: description for block, description in pieces}
        self.note("samples", {"streams": streams}, [block for block, _ in pieces])

    def done(self, **summary):
        self.note("reply", {"recorded": True, "seconds": 1.0, "streams": summary})

    def record(self):
        header = read(DOOR).header
        create(self.path, header, {"at": "2026-01-01T00:00:00+00:00"})
        ledger = open_for_append(self.path, {"at": "2026-01-01T00:00:00+00:00"})
        try:
            for event in self.events:
                ledger.append(event)
        finally:
            ledger.close({"at": "2026-01-01T00:00:00+00:00", "because": "complete"})
        return read(self.path)


def block(name, values, rate_hz, first=0, t0_s=0.0, clock="host", channels=("value",), units=("N",)):
    """Samples of float32 rows."""
    rows = np.asarray(values, dtype="<f4").reshape(-1, len(channels))
    return Samples(name, channels, units, rate_hz, round(t0_s * NS), rows.tobytes(), first, clock)


def block_description(first, count, arrived=(), gaps=()):
    """What the recorder says of a chunk's stream beside its samples."""
    lost = sum(gap[1] for gap in gaps)
    return {
        "first": first, "count": count, "lost": lost, "why": "; ".join(gap[2] for gap in gaps),
        "arrived": [[n, round(t_s * NS), *rest] for n, t_s, *rest in arrived],
        **({"gaps": [list(gap) for gap in gaps]} if gaps else {}),
    }  # fmt: skip


def chunks(written, streams, seconds=0.5):
    """Record whole streams: {name: (values by sample number, rate, true rate, t0_s, delay(), further of block)}."""
    at = dict.fromkeys(streams, 0)
    while any(at[name] < len(streams[name][0]) for name in streams):
        pieces = []
        for name, (values, rate_hz, true_hz, t0_s, delay, further) in streams.items():
            count = round(seconds * rate_hz)
            part = values[at[name] : at[name] + count]
            if len(part):
                ends = range(at[name] + max(1, count // 16) - 1, at[name] + len(part), max(1, count // 16))
                arrived = [(n, t0_s + n / true_hz + delay()) for n in ends]
                piece = block(name, part, rate_hz, at[name], t0_s + at[name] / true_hz, **further)
                pieces.append((piece, block_description(at[name], len(part), arrived)))
                at[name] += len(part)
        written.chunk(*pieces)

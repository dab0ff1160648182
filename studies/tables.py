"""A session as plain rows: what happened, derived from its events and never stored twice."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from protocols.canonical import canonical, digest
from protocols.events import NS, Event
from protocols.study import Study
from studies.record import Record
from studies.replay import recompiled

Row = dict[str, Any]


@dataclass(frozen=True)
class SessionTables:
    """Rows of one session for each collected table."""

    study: Row
    participant: Row
    session: Row
    trials: list[Row]
    responses: list[Row]
    events: list[Row]
    streams: list[Row]


@dataclass
class _Met:
    """What has become of one trial so far."""

    attempts: int = 0
    status: str = "not met"
    answered_at: int | None = None


@dataclass
class _Walk:
    """One pass over the events."""

    session: str
    met: dict[int, _Met] = field(default_factory=dict)
    standing: dict[int, list[Row]] = field(default_factory=dict)
    responses: list[Row] = field(default_factory=list)
    request: Any = None

    def take(self, event: Event) -> None:
        if event.kind == "request":
            self.request = event.value
        if event.trial is None:
            return
        trial = self.met.setdefault(event.trial, _Met())
        if event.kind == "trial_started":
            trial.attempts, trial.status = event.attempt or 0, "started"
        elif event.kind == "trial_ended":
            trial.status = event.value["as"] if trial.answered_at is None else "answered"
        elif event.kind == "reply" and self.request["do"] == "ask" and "answers" in event.value:
            self._answers(event, trial)

    def _answers(self, event: Event, trial: _Met) -> None:
        value, revised = event.value, self.request["previous"] is not None
        for row in self.standing.get(event.trial or 0, ()):
            row["counts"] = False
        trial.answered_at = event.seq
        now = [
            {
                "session": self.session,
                "trial": event.trial,
                "attempt": event.attempt,
                "attribute": attribute,
                "value": float(value["answers"][attribute]),
                "response_time_s": value.get("at_s", {}).get(attribute),
                "revised": revised,
                "counts": True,
            }
            for attribute in self.request["items"]
        ]
        self.standing[event.trial or 0] = now
        self.responses += now


def tables(record: Record) -> SessionTables:
    """Every table's rows for one session."""
    plan = recompiled(record)
    header = record.header
    session = session_name(record)
    walk = _Walk(session)
    for event in record.events:
        walk.take(event)
    antonyms = {attribute.name: attribute.high for attribute in plan.study.attributes}
    who = {"study": plan.study.study, "participant": plan.who.participant}
    return SessionTables(
        study=_study_row(plan.study),
        participant={**who, "group_name": header["group"], "row": header["row"]},
        session=_session_row(record, walk),
        trials=[_trial_row(session, trial, walk.met.get(trial.number, _Met())) for trial in plan.trials],
        responses=[{**row, "antonym": antonyms[row["attribute"]]} for row in walk.responses],
        events=[_event_row(session, e, h) for e, h in zip(record.events, record.hashes, strict=True)],
        streams=list(_stream_rows(session, record.events)),
    )


def session_name(record: Record) -> str:
    """STUDY/PARTICIPANT/NUMBER: the session's name among all sessions of a lab."""
    header = record.header
    return f"{header['study']['study']}/{header['participant']}/{header['session']}"


def _study_row(study: Study) -> Row:
    definition = study.definition()
    text = canonical(definition).decode()
    return {"study_digest": digest(definition), "study": study.study, "title": study.title, "definition": text}


def _session_row(record: Record, walk: _Walk) -> Row:
    header = record.header
    return {
        "session": walk.session,
        "study": header["study"]["study"],
        "study_digest": digest(header["study"]),
        "participant": header["participant"],
        "group_name": header["group"],
        "row": header["row"],
        "seed": header["seed"],
        "simulated": header["rig"]["kind"] == "simulated",
        "status": "complete" if record.complete else "interrupted",
        "trials_planned": header["trials"],
        "trials_answered": sum(met.answered_at is not None for met in walk.met.values()),
        "events": len(record.events),
        "first_hash": record.hashes[0],
        "head_hash": record.head,
        "file": record.path.name,
        "file_sha256": hashlib.sha256(record.path.read_bytes()).hexdigest(),
        "started_at": record.sittings[0].value["at"],
        "sittings": sum(sitting.kind == "opened" for sitting in record.sittings),
        "duration_s": record.events[-1].t_ns / NS,
        "palpate_version": header["environment"]["palpate"],
    }


def _trial_row(session: str, trial: Any, met: _Met) -> Row:
    return {
        "session": session,
        "trial": trial.number,
        "block": trial.block,
        "practice": trial.practice,
        "stimulus": trial.stimulus.id,
        "attempts": met.attempts,
        "status": met.status,
    }


def _event_row(session: str, event: Event, link: str) -> Row:
    return {
        "session": session,
        "seq": event.seq,
        "t_ns": event.t_ns,
        "kind": event.kind,
        "trial": event.trial,
        "attempt": event.attempt,
        "body": event.body.decode(),
        "hash": link,
    }


def _stream_rows(session: str, events: Sequence[Event]) -> Iterator[Row]:
    for event in events:
        for number, block in enumerate(event.samples):
            yield {
                "session": session,
                "seq": event.seq,
                "block": number,
                "trial": event.trial,
                "stream": block.stream,
                "channels": ",".join(block.channels),
                "units": ",".join(block.units),
                "rate_hz": float(block.rate_hz),
                "t0_ns": block.t0_ns,
                "samples": block.count,
                "sha256": hashlib.sha256(block.data).hexdigest(),
            }

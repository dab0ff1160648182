"""A session as plain rows, derived from its events and never stored twice."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palpate.protocols.canonical import canonical, digest
from palpate.protocols.events import NS, Event
from palpate.protocols.extensions import extensions_in
from palpate.protocols.files import file_sha256
from palpate.protocols.forms import FORMS, OwnTable, own_tables_of, table_of
from palpate.protocols.plan import Plan
from palpate.protocols.session_state import Answer, SessionState, fold
from palpate.protocols.study import conditions_of
from palpate.protocols.trial import Trial
from palpate.studies.sessions.model_versions import models_in
from palpate.studies.sessions.record import LedgerError, Record
from palpate.studies.sessions.replay import recompiled
from palpate.studies.sessions.session_files import by_twins

Row = dict[str, Any]
TEXT = "text"
"""The kind of an answer in the participant's own words."""


@dataclass(frozen=True)
class Answers:
    """The answers of one session, as rows of the tables of these names."""

    trials: list[Row]
    responses: list[Row]
    words: list[Row]
    answers: list[Row]
    switches: list[Row]
    anchors: list[Row]
    own: defaultdict[str, list[Row]]
    """Rows of the own tables of forms, by table."""


@dataclass(frozen=True)
class SessionTables(Answers):
    """The rows of one session for each collected table."""

    study: Row
    participant: Row
    session: Row
    events: list[Row]
    streams: list[Row]
    extensions: tuple[str, ...] = ()
    """The extensions that the session's task comes from, whose tables hold its answers."""


def tables(record: Record, withdrawn: bool = False, with_events: bool = True) -> SessionTables:
    """Return every table's rows for one session; `withdrawn` marks a participant who withdrew.

    With `with_events` False, `events` has only the replies that name models, and `streams` is empty.
    """
    plan = recompiled(record)
    session = session_name_of(record.header)
    answers = _answers(plan, session, record.state, record.events)
    if unknown := {row["attribute"] for row in answers.responses} - {
        attribute.name for attribute in plan.study.attributes
    }:
        raise LedgerError(f"{record.path}: {min(unknown)!r} was rated, which is not an attribute of the recorded study")
    who = {"study": plan.study.study, "participant": plan.who.participant}
    return SessionTables(
        **vars(answers),
        study={
            "study_digest": digest(plan.study.conditions()),
            "study": plan.study.study,
            "title": plan.study.title,
            "definition": canonical(plan.study.definition()).decode(),
        },
        participant={**who, "group_name": record.header["group"], "row": record.header["row"]},
        session=_session_row(record) | ({"status": "withdrawn"} if withdrawn else {}),
        events=[
            _event_row(session, event, link)
            for event, link in zip(record.events, record.hashes, strict=True)
            if with_events or (event.kind == "reply" and any(models_in(event.value)))
        ],
        streams=list(_stream_rows(session, record.events)) if with_events else [],
        extensions=extensions_in([plan.study.task]),
    )


def answers_of(plan: Plan, session: str, events: Sequence[Event]) -> Answers:
    """Return the answers in the events of a session, which need not be on disk."""
    return _answers(plan, session, fold(events), events)


def _answers(plan: Plan, session: str, state: SessionState, events: Sequence[Event]) -> Answers:
    rows = Answers([_trial_row(session, trial, state) for trial in plan.trials], [], [], [], [], [], defaultdict(list))
    antonyms = {attribute.name: attribute.high for attribute in plan.study.attributes}
    questions = plan.lab_forms.questions if plan.lab_forms is not None else ()
    kinds = {question.name: question.kind for question in questions}
    for answer in state.answers:
        request, reply = events[answer.request].value, events[answer.seq].value
        table = table_of(answer.form)
        if (owned := own_tables_of(answer.form)) and answer.trial is not None:
            for own in owned:
                rows.own[own.name] += _own_rows(own, plan, session, answer, request, reply, state.counts(answer))
        elif table == "anchors":
            rows.anchors.append(_anchor_row(session, answer, request["anchor"]))
        elif table == "words":
            rows.words.extend(_word_rows(session, answer, state.counts(answer)))
        elif answer.trial is None:
            rows.answers.extend(_answer_rows(session, answer, kinds))
        else:
            shared = {"revised": request["previous"] is not None, "counts": state.counts(answer)}
            rows.responses.extend(_response_rows(session, answer, reply.get("at_s", {}), shared, antonyms))
        rows.switches.extend(_switch_rows(session, answer, reply.get("switches", ())))
    return rows


def _trial_row(session: str, trial: Trial, state: SessionState) -> Row:
    done = state.trials.get(trial.number)
    return {
        "session": session,
        "trial": trial.number,
        "block": trial.block,
        "practice": trial.practice,
        "stimulus": trial.stimulus.id,
        "attempts": 0 if done is None else done.attempts[-1].number,
        "status": "not met" if done is None else done.status,
    }


def _response_rows(
    session: str, answer: Answer, times_s: Mapping[str, float], shared: Row, antonyms: Mapping[str, str]
) -> Iterator[Row]:
    for attribute in answer.items:
        yield {
            "session": session,
            "trial": answer.trial,
            "attempt": answer.attempt,
            "attribute": attribute,
            "value": float(answer.values[attribute]),
            "response_time_s": times_s.get(attribute),
            **shared,
            "antonym": antonyms.get(attribute),
        }


def _own_rows(
    table: OwnTable, plan: Plan, session: str, answer: Answer, request: Row, reply: Row, counts: bool
) -> Iterator[Row]:
    """Yield the rows of a form with a table of its own, with the session and trial that they belong to."""
    trial = plan.trials[(answer.trial or 1) - 1]
    shared = {
        "session": session, "seq": answer.seq, "participant": plan.who.participant, "trial": trial.number,
        "session_number": int(session_number(session)),
        "attempt": answer.attempt, "block": trial.block, "practice": trial.practice,
    }  # fmt: skip
    for row in table.rows(trial.form, answer.values, reply, request):
        yield {**shared, **row, "counts": counts}


def _word_rows(session: str, answer: Answer, counts: bool) -> Iterator[Row]:
    pairs = [(kind, word) for kind, words in answer.values.items() for word in words]
    for n, (kind, word) in enumerate(pairs):
        yield {
            "session": session,
            "seq": answer.seq,
            "n": n,
            "form": answer.form,
            "trial": answer.trial,
            "attempt": answer.attempt,
            "kind": kind,
            "word": word,
            "counts": counts,
        }


def _anchor_row(session: str, answer: Answer, anchor: Mapping[str, Any]) -> Row:
    """Return the row of a reference as it was left; it belongs to no trial."""
    return {
        "session": session,
        "seq": answer.seq,
        "block": anchor["block"],
        "number": anchor["number"],
        "stimulus": anchor["id"],
        "label": anchor["label"],
        "attribute": anchor.get("attribute"),
        "value": float(anchor["value"]) if "value" in anchor else None,
        "felt": answer.values["felt"],
    }


def _answer_rows(session: str, answer: Answer, kinds: Mapping[str, str]) -> Iterator[Row]:
    """Yield the rows of a form outside trials; `kinds` are those of the lab's questions by name."""
    kind = FORMS[answer.form].answer_kind if answer.form in FORMS else TEXT
    for item in answer.items:
        value = answer.values[item]
        yield {
            "session": session,
            "seq": answer.seq,
            "item": item,
            "form": answer.form,
            "kind": kinds.get(item, TEXT) if kind == "by question" else kind,
            "value": value if isinstance(value, str) else canonical(value).decode(),
            "number": float(value) if type(value) in (int, float) else None,
        }


def _switch_rows(session: str, answer: Answer, switches: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    for n, switch in enumerate(switches):
        yield {
            "session": session,
            "seq": answer.seq,
            "n": n,
            "trial": answer.trial,
            "side": switch["to"],
            "at_s": switch["at_s"],
        }


def session_name(study: str, participant: str, number: int) -> str:
    """Return STUDY/PARTICIPANT/NUMBER, which names the session among all sessions of a lab."""
    return f"{study}/{participant}/{number}"


def session_name_of(header: Mapping[str, Any]) -> str:
    """Return the name of the session with this header."""
    return session_name(header["study"]["study"], header["participant"], header["session"])


def session_number(name: str) -> str:
    """Return the number in a session's name: which of the participant's sessions it is."""
    return name.rpartition("/")[2]


def certificates_in(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return what `palpate rig certify` measured of the session's devices, by their names in the rig file."""
    settings = header["rig"].get("settings") or {}
    devices = {name: own.get("certificate") for name, own in settings.items() if isinstance(own, Mapping)}
    return {name: certificate for name, certificate in devices.items() if certificate is not None}


def _session_row(record: Record) -> Row:
    header = record.header
    return {
        "session": session_name_of(header),
        "study": header["study"]["study"],
        "study_digest": digest(conditions_of(header["study"])),
        "participant": header["participant"],
        "number": header["session"],
        "group_name": header["group"],
        "row": header["row"],
        "seed": header["seed"],
        "simulated": by_twins(header),
        "status": record.status,
        "trials_planned": header["trials"],
        "trials_answered": len(record.state.counting),
        "events": len(record.events),
        "first_hash": record.hashes[0],
        "head_hash": record.head,
        "file": record.path.name,
        "file_sha256": file_sha256(record.path),
        "started_at": record.run_notes[0].value["at"],
        "sittings": sum(note.kind == "opened" for note in record.run_notes),
        "duration_s": record.events[-1].t_ns / NS,
        "palpate_version": header["environment"]["palpate"],
        "certificates": canonical(certificates_in(header)).decode(),
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
                "attempt": event.attempt,
                "stream": block.stream,
                "channels": ",".join(block.channels),
                "units": ",".join(block.units),
                "rate_hz": float(block.rate_hz),
                "t0_ns": block.t0_ns,
                "first": block.first,
                "clock": block.clock,
                "samples": block.count,
                "sha256": block.sha256().hex(),
            }

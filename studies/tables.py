"""A session as plain rows: what happened, derived from its events and never stored twice."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from palpate.protocols.canonical import canonical, digest
from palpate.protocols.event_shapes import WORD_FORMS
from palpate.protocols.events import NS, Event
from palpate.protocols.files import file_sha256
from palpate.protocols.plan import Plan
from palpate.protocols.study import Study, conditions_of
from palpate.studies.begun import by_twins
from palpate.studies.model_versions import models_in
from palpate.studies.record import LedgerError, Record
from palpate.studies.replay import recompiled

Row = dict[str, Any]
TEXT = "text"
"""The kind of an answer in the participant's own words."""


@dataclass(frozen=True)
class SessionTables:
    """Rows of one session for each collected table."""

    study: Row
    participant: Row
    session: Row
    trials: list[Row]
    responses: list[Row]
    words: list[Row]
    answers: list[Row]
    switches: list[Row]
    anchors: list[Row]
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
    kinds: Mapping[str, str] = field(default_factory=dict)
    met: dict[int, _Met] = field(default_factory=dict)
    standing: dict[int, list[Row]] = field(default_factory=dict)
    responses: list[Row] = field(default_factory=list)
    words: list[Row] = field(default_factory=list)
    answers: list[Row] = field(default_factory=list)
    switches: list[Row] = field(default_factory=list)
    anchors: list[Row] = field(default_factory=list)
    request: Any = None

    def take(self, event: Event) -> None:
        if event.kind == "request":
            self.request = event.value
        if event.trial is not None:
            self._progress(event, self.met.setdefault(event.trial, _Met()))
        if event.kind == "experimenter" and event.value.get("which") == "last" and event.trial is not None:
            self._repeat_before(event.trial)
        if event.kind == "reply" and self.request["do"] == "ask" and "answers" in event.value:
            self._answered(event)

    def _progress(self, event: Event, trial: _Met) -> None:
        if event.kind == "trial_started":
            trial.attempts, trial.status = event.attempt or 0, "started"
        elif event.kind == "trial_ended":
            as_ = event.value["as"]
            if as_ == "captured":
                trial.answered_at = event.seq
            if as_ == "repeated":
                self._withdraw(event.trial or 0, trial)
            trial.status = "answered" if trial.answered_at is not None and as_ != "captured" else as_

    def _withdraw(self, number: int, trial: _Met) -> None:
        """A trial that is repeated has no answer until it is answered anew."""
        trial.answered_at = None
        self._stand(number, [])

    def _repeat_before(self, number: int) -> None:
        """The trial before is to be answered anew, whether or not the session comes to it."""
        if before := self.met.get(number - 1):
            self._withdraw(number - 1, before)
            before.status = "repeated"

    def _stand(self, number: int, rows: list[Row]) -> None:
        for row in self.standing.get(number, ()):
            row["counts"] = False
        self.standing[number] = rows

    def _answered(self, event: Event) -> None:
        if event.value.get("go") == "try":
            return
        table, made = self._unfolded(event)
        rows = list(made)
        table += rows
        if event.trial is not None:
            self.met[event.trial].answered_at = event.seq
            self._stand(event.trial, rows)
        self.switches += [
            {
                "session": self.session,
                "seq": event.seq,
                "n": n,
                "trial": event.trial,
                "side": each["to"],
                "at_s": each["at_s"],
            }
            for n, each in enumerate(event.value.get("switches", ()))
        ]

    def _unfolded(self, event: Event) -> tuple[list[Row], Iterator[Row]]:
        """The table that a form's answers belong to, and the rows they make."""
        if self.request["form"] == "anchor":
            return self.anchors, self._anchor(event)
        if self.request["form"] in WORD_FORMS:
            return self.words, self._words(event)
        if event.trial is None:
            return self.answers, self._about(event)
        return self.responses, self._ratings(event)

    def _ratings(self, event: Event) -> Iterator[Row]:
        value = event.value
        for attribute in self.request["items"]:
            yield {
                "session": self.session,
                "trial": event.trial,
                "attempt": event.attempt,
                "attribute": attribute,
                "value": float(value["answers"][attribute]),
                "response_time_s": value.get("at_s", {}).get(attribute),
                "revised": self.request["previous"] is not None,
                "counts": True,
            }

    def _words(self, event: Event) -> Iterator[Row]:
        said = [(kind, word) for kind, words in event.value["answers"].items() for word in words]
        for n, (kind, word) in enumerate(said):
            yield {
                "session": self.session,
                "seq": event.seq,
                "n": n,
                "form": self.request["form"],
                "trial": event.trial,
                "attempt": event.attempt,
                "kind": kind,
                "word": word,
                "counts": True,
            }

    def _anchor(self, event: Event) -> Iterator[Row]:
        """A reference as it was left; what was felt of it belongs to no trial."""
        anchor = self.request["anchor"]
        yield {
            "session": self.session,
            "seq": event.seq,
            "block": anchor["block"],
            "number": anchor["number"],
            "stimulus": anchor["id"],
            "label": anchor["label"],
            "attribute": anchor.get("attribute"),
            "value": float(anchor["value"]) if "value" in anchor else None,
            "felt": event.value["answers"]["felt"],
        }

    def _kind(self, item: str) -> str:
        """What an answer outside trials is: a question's kind, points, or agreed; a text of the participant's own."""
        match self.request["form"]:
            case "demographics":
                return self.kinds.get(item, TEXT)
            case "likert":
                return "points"
            case "consent":
                return "agreed"
        return TEXT

    def _about(self, event: Event) -> Iterator[Row]:
        for item in self.request["items"]:
            answer = event.value["answers"][item]
            number = float(answer) if type(answer) in (int, float) else None
            yield {
                "session": self.session,
                "seq": event.seq,
                "item": item,
                "form": self.request["form"],
                "kind": self._kind(item),
                "value": answer if isinstance(answer, str) else canonical(answer).decode(),
                "number": number,
            }


def tables(record: Record, withdrawn: bool = False, with_events: bool = True) -> SessionTables:
    """Every table's rows for one session; `withdrawn` marks that of a participant who withdrew.

    Without events, of these only the replies that name models stay, and no streams: what was answered is in the others.
    """
    plan = recompiled(record)
    header = record.header
    session = session_name(record)
    walk = _walked(plan, session, record.events)
    if unknown := {row["attribute"] for row in walk.responses} - {
        attribute.name for attribute in plan.study.attributes
    }:
        raise LedgerError(f"{record.path}: {min(unknown)!r} was rated, which is no attribute of the recorded study")
    who = {"study": plan.study.study, "participant": plan.who.participant}
    return SessionTables(
        study=_study_row(plan.study),
        participant={**who, "group_name": header["group"], "row": header["row"]},
        session=_session_row(record, walk) | ({"status": "withdrawn"} if withdrawn else {}),
        trials=_trial_rows(plan, walk),
        responses=_response_rows(plan, walk),
        words=walk.words,
        answers=walk.answers,
        switches=walk.switches,
        anchors=walk.anchors,
        events=[
            _event_row(session, event, link)
            for event, link in zip(record.events, record.hashes, strict=True)
            if with_events or (event.kind == "reply" and any(models_in(event.value)))
        ],
        streams=list(_stream_rows(session, record.events)) if with_events else [],
    )


@dataclass(frozen=True)
class Answers:
    """What one session answered, as rows of the tables trials, responses, words, answers and anchors."""

    trials: list[Row]
    responses: list[Row]
    words: list[Row]
    answers: list[Row]
    anchors: list[Row]


def answers_of(plan: Plan, session: str, events: Iterable[Event]) -> Answers:
    """The answers in the events of a session that need not be on file."""
    walk = _walked(plan, session, events)
    return Answers(_trial_rows(plan, walk), _response_rows(plan, walk), walk.words, walk.answers, walk.anchors)


def _walked(plan: Plan, session: str, events: Iterable[Event]) -> _Walk:
    questions = plan.lab_forms.questions if plan.lab_forms is not None else ()
    walk = _Walk(session, {question.name: question.kind for question in questions})
    for event in events:
        walk.take(event)
    return walk


def _trial_rows(plan: Plan, walk: _Walk) -> list[Row]:
    return [_trial_row(walk.session, trial, walk.met.get(trial.number, _Met())) for trial in plan.trials]


def _response_rows(plan: Plan, walk: _Walk) -> list[Row]:
    antonyms = {attribute.name: attribute.high for attribute in plan.study.attributes}
    return [{**row, "antonym": antonyms[row["attribute"]]} for row in walk.responses]


def session_name(record: Record) -> str:
    """STUDY/PARTICIPANT/NUMBER: the session's name among all sessions of a lab."""
    header = record.header
    return f"{header['study']['study']}/{header['participant']}/{header['session']}"


def session_number(name: str) -> str:
    """Return the number in a session's name: which of the participant's sessions it is."""
    return name.rpartition("/")[2]


def _study_row(study: Study) -> Row:
    text = canonical(study.definition()).decode()
    return {"study_digest": digest(study.conditions()), "study": study.study, "title": study.title, "definition": text}


def _session_row(record: Record, walk: _Walk) -> Row:
    header = record.header
    return {
        "session": walk.session,
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
        "trials_answered": sum(met.answered_at is not None for met in walk.met.values()),
        "events": len(record.events),
        "first_hash": record.hashes[0],
        "head_hash": record.head,
        "file": record.path.name,
        "file_sha256": file_sha256(record.path),
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

"""A session's rows for each shared table, derived from the collected ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from palpate.analysis.exporting.source import SharedSession, Source
from palpate.analysis.exporting.tabular import Row
from palpate.protocols.events import NS
from palpate.protocols.forms import own_tables
from palpate.studies.collecting import schema

Key = tuple[int, int]
AGE, OLDEST = "age", 89
"""The cap of ages that BIDS recommends: the oldest are few enough to be recognised by their age."""


@dataclass(frozen=True)
class SessionRows:
    """The rows of one session; data that several tables need are read once."""

    source: Source
    session: SharedSession

    @cached_property
    def events(self) -> list[dict[str, Any]]:
        """The session's events."""
        return self.source.of(self.session, schema.events, "seq")

    @cached_property
    def trials_by_number(self) -> dict[int, dict[str, Any]]:
        """The session's planned trials by number."""
        return {row["trial"]: row for row in self.source.of(self.session, schema.trials, "trial")}

    @cached_property
    def onsets(self) -> dict[Key, float]:
        """The time at which each (trial, attempt) began, in seconds since the session's start."""
        return {
            (event["trial"], event["attempt"]): event["t_ns"] / NS
            for event in self.events if event["kind"] == "trial_started"
        }  # fmt: skip

    @cached_property
    def request_s(self) -> dict[int, float]:
        """The time of each reply's request by the reply's number, in seconds since the session's start."""
        times, last = {}, 0.0
        for event in self.events:
            if event["kind"] == "request":
                last = event["t_ns"] / NS
            elif event["kind"] == "reply":
                times[event["seq"]] = last
        return times

    @cached_property
    def seconds(self) -> dict[int, float | None]:
        """How many seconds each answer took, by the reply's number."""
        return {
            event["seq"]: json.loads(event["body"]).get("seconds") for event in self.events if event["kind"] == "reply"
        }

    def session_row(self) -> Row:
        """Return the row of the session as a whole."""
        row = self.session.row
        same = (
            "status", "seed", "trials_planned", "trials_answered", "sittings", "duration_s", "study_digest",
            "head_hash", "palpate_version", "started_at",
        )  # fmt: skip
        return {**self._who(), "group": row["group_name"], "counterbalancing_row": row["row"],
                **{name: row[name] for name in same}, "simulated": bool(row["simulated"])}  # fmt: skip

    def trials(self) -> Iterator[Row]:
        """Yield each planned trial, whatever its outcome."""
        for number, row in self.trials_by_number.items():
            onset = self.onsets.get((number, row["attempts"]))
            yield {
                **self._who(),
                **_trial_columns_of(row),
                "attempts": row["attempts"],
                "status": row["status"],
                "onset_s": onset,
            }

    def ratings(self) -> Iterator[Row]:
        """Yield each answer to an attribute, including revised ones and those of practice trials."""
        place = {attribute.name: n for n, attribute in enumerate(self.source.study.attributes)}
        rows = self.source.of(self.session, schema.responses, "trial", "attempt")
        for row in sorted(rows, key=lambda r: (r["trial"], r["attempt"], place.get(r["attribute"], len(place)))):
            same = ("attribute", "antonym", "value", "response_time_s")
            yield {**self._of_trial(row["trial"], row["attempt"]), **{name: row[name] for name in same},
                   "revised": bool(row["revised"]), "counts": bool(row["counts"])}  # fmt: skip

    def words(self) -> Iterator[Row]:
        """Yield each word that was ticked or written."""
        for row in self.source.of(self.session, schema.words, "seq", "n"):
            yield {**self._of_trial(row["trial"], row["attempt"]), "form": row["form"], "kind": row["kind"],
                   "number": row["n"] + 1, "word": row["word"], "response_time_s": self.seconds.get(row["seq"]),
                   "counts": bool(row["counts"])}  # fmt: skip

    def answers(self) -> Iterator[Row]:
        """Yield the last answer to each question outside trials, except consent and eligibility, which all have."""
        last: dict[tuple[str, str], dict[str, Any]] = {}
        for row in self.source.of(self.session, schema.answers, "seq"):
            if row["form"] not in ("consent", "eligibility"):
                last[row["form"], row["item"]] = row
        for (form, item), row in last.items():
            value, number = (None, None) if row["value"] == "null" else (row["value"], row["number"])
            if form == "demographics" and item == AGE and number is not None and number > OLDEST:
                value, number = str(OLDEST), float(OLDEST)
            yield {**self._who(), "form": form, "item": item, "value": value, "value_number": number}

    def switches(self) -> Iterator[Row]:
        """Yield each switch between the sides of a comparison."""
        for row in self.source.of(self.session, schema.switches, "seq", "n"):
            yield {**self._who(), "trial": row["trial"], "number": row["n"] + 1, "side": row["side"],
                   "at_s": row["at_s"], "onset_s": self.request_s[row["seq"]] + row["at_s"]}  # fmt: skip

    def anchors(self) -> Iterator[Row]:
        """Yield each reference that was felt before a block."""
        for row in self.source.of(self.session, schema.anchors, "seq"):
            same = ("block", "number", "stimulus", "label", "attribute", "value", "felt")
            yield {**self._who(), **{name: row[name] for name in same}, "onset_s": self.request_s[row["seq"]]}

    def own(self, name: str) -> Iterator[Row]:
        """Yield the rows of a form's own table."""
        names = [column.name for column in own_tables()[name].columns]
        for row in self.source.of(self.session, schema.form_tables()[name], "seq", *names):
            values = {name: row[name] for name in names}
            yield {**self._of_trial(row["trial"], row["attempt"]), **values, "counts": bool(row["counts"])}

    def streams(self) -> Iterator[Row]:
        """Yield each recording of a stream with joined blocks and the number of samples missing between them."""
        recordings: dict[tuple[Any, ...], Row] = {}
        times: dict[tuple[int | None, int | None, str], int] = {}
        for row in self.source.of(self.session, schema.streams, "seq", "block"):
            where = (row["trial"], row["attempt"], row["stream"])
            last = recordings.get((*where, times.get(where, 0)))
            if last is None or row["first"] < int(last["next"] or 0):
                times[where] = times.get(where, 0) + 1
                same = ("trial", "attempt", "stream", "channels", "units", "rate_hz")
                before_s = row["first"] / row["rate_hz"] if row["rate_hz"] else 0.0
                last = recordings[(*where, times[where])] = {
                    **self._who(), **{name: row[name] for name in same}, "recording": times[where], "next": 0,
                    "start_s": row["t0_ns"] / NS - before_s, "samples": 0, "lost": 0, "gaps": 0,
                }  # fmt: skip
            gap = row["first"] - int(last["next"] or 0)
            last["samples"] = int(last["samples"] or 0) + row["samples"]
            last["lost"] = int(last["lost"] or 0) + gap
            last["gaps"] = int(last["gaps"] or 0) + (gap > 0)
            last["next"] = row["first"] + row["samples"]
        yield from recordings.values()

    def _who(self) -> Row:
        return {"participant": self.session.participant, "session": self.session.number}

    def _of_trial(self, number: int | None, attempt: int | None) -> Row:
        """Return the columns that rows of a trial share; outside trials only the participant and session."""
        if number is None or attempt is None:
            return {**self._who(), "trial": None}
        about = _trial_columns_of(self.trials_by_number[number])
        return {**self._who(), **about, "attempt": attempt, "onset_s": self.onsets.get((number, attempt))}


def _trial_columns_of(trial: dict[str, Any]) -> Row:
    same = {name: trial[name] for name in ("trial", "block", "stimulus")}
    return {**same, "practice": bool(trial["practice"])}

"""A session's rows for each shared table, derived from the collected ones."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from palpate.analysis.exporting.source import Sat, Source
from palpate.analysis.exporting.tabular import Row
from palpate.protocols.events import NS
from palpate.studies import collected_schema as schema

Key = tuple[int, int]
AGE, OLDEST = "age", 89
"""BIDS recommends this cap: the oldest are few enough to be known by their age."""


@dataclass(frozen=True)
class SessionRows:
    """One session; what several tables need of it is read once."""

    source: Source
    sat: Sat

    @cached_property
    def events(self) -> list[dict[str, Any]]:
        """Its events."""
        return self.source.of(self.sat, schema.events, "seq")

    @cached_property
    def trials_by_number(self) -> dict[int, dict[str, Any]]:
        """Its planned trials."""
        return {row["trial"]: row for row in self.source.of(self.sat, schema.trials, "trial")}

    @cached_property
    def onsets(self) -> dict[Key, float]:
        """(trial, attempt) -> when it began, in seconds since the session did."""
        return {
            (each["trial"], each["attempt"]): each["t_ns"] / NS
            for each in self.events if each["kind"] == "trial_started"
        }  # fmt: skip

    @cached_property
    def asked_s(self) -> dict[int, float]:
        """Number of a reply -> when what it replies to was asked, in seconds since the session began."""
        found, last = {}, 0.0
        for each in self.events:
            if each["kind"] == "request":
                last = each["t_ns"] / NS
            elif each["kind"] == "reply":
                found[each["seq"]] = last
        return found

    @cached_property
    def seconds(self) -> dict[int, float | None]:
        """Number of a reply -> how long the answer took."""
        return {each["seq"]: json.loads(each["body"]).get("seconds") for each in self.events if each["kind"] == "reply"}

    def session(self) -> Row:
        """What is known of the session as a whole."""
        row = self.sat.row
        same = (
            "status", "seed", "trials_planned", "trials_answered", "sittings", "duration_s", "study_digest",
            "head_hash", "palpate_version", "started_at",
        )  # fmt: skip
        return {**self._who(), "group": row["group_name"], "counterbalancing_row": row["row"],
                **{name: row[name] for name in same}, "simulated": bool(row["simulated"])}  # fmt: skip

    def trials(self) -> Iterator[Row]:
        """Each planned trial, whatever became of it."""
        for number, row in self.trials_by_number.items():
            onset = self.onsets.get((number, row["attempts"]))
            yield {**self._who(), **_about(row), "attempts": row["attempts"], "status": row["status"], "onset_s": onset}

    def ratings(self) -> Iterator[Row]:
        """Each answer to an attribute, also those that were revised since, and those of practice trials."""
        place = {attribute.name: n for n, attribute in enumerate(self.source.study.attributes)}
        rows = self.source.of(self.sat, schema.responses, "trial", "attempt")
        for row in sorted(rows, key=lambda r: (r["trial"], r["attempt"], place.get(r["attribute"], len(place)))):
            kept = ("attribute", "antonym", "value", "response_time_s")
            yield {**self._of_trial(row["trial"], row["attempt"]), **{name: row[name] for name in kept},
                   "revised": bool(row["revised"]), "counts": bool(row["counts"])}  # fmt: skip

    def words(self) -> Iterator[Row]:
        """Each word that was ticked or written."""
        for row in self.source.of(self.sat, schema.words, "seq", "n"):
            yield {**self._of_trial(row["trial"], row["attempt"]), "form": row["form"], "kind": row["kind"],
                   "number": row["n"] + 1, "word": row["word"], "response_time_s": self.seconds.get(row["seq"]),
                   "counts": bool(row["counts"])}  # fmt: skip

    def answers(self) -> Iterator[Row]:
        """The last answer to each question outside trials; of consent and eligibility, which all have, nothing."""
        last: dict[tuple[str, str], dict[str, Any]] = {}
        for row in self.source.of(self.sat, schema.answers, "seq"):
            if row["form"] not in ("consent", "eligibility"):
                last[row["form"], row["item"]] = row
        for (form, item), row in last.items():
            value, number = (None, None) if row["value"] == "null" else (row["value"], row["number"])
            if form == "demographics" and item == AGE and number is not None and number > OLDEST:
                value, number = str(OLDEST), float(OLDEST)
            yield {**self._who(), "form": form, "item": item, "value": value, "value_number": number}

    def switches(self) -> Iterator[Row]:
        """Each change between the sides of a comparison."""
        for row in self.source.of(self.sat, schema.switches, "seq", "n"):
            yield {**self._who(), "trial": row["trial"], "number": row["n"] + 1, "side": row["side"],
                   "at_s": row["at_s"], "onset_s": self.asked_s[row["seq"]] + row["at_s"]}  # fmt: skip

    def anchors(self) -> Iterator[Row]:
        """Each reference that was felt before a block."""
        for row in self.source.of(self.sat, schema.anchors, "seq"):
            same = ("block", "number", "stimulus", "label", "attribute", "value", "felt")
            yield {**self._who(), **{name: row[name] for name in same}, "onset_s": self.asked_s[row["seq"]]}

    def streams(self) -> Iterator[Row]:
        """Each recording of a stream: its blocks joined, what lacks between them counted."""
        found: dict[tuple[Any, ...], Row] = {}
        times: dict[tuple[int | None, int | None, str], int] = {}
        for row in self.source.of(self.sat, schema.streams, "seq", "block"):
            where = (row["trial"], row["attempt"], row["stream"])
            last = found.get((*where, times.get(where, 0)))
            if last is None or row["first"] < int(last["next"] or 0):
                times[where] = times.get(where, 0) + 1
                last = found[(*where, times[where])] = self._recording(row, times[where])
            gap = row["first"] - int(last["next"] or 0)
            last["samples"] = int(last["samples"] or 0) + row["samples"]
            last["lost"] = int(last["lost"] or 0) + gap
            last["gaps"] = int(last["gaps"] or 0) + (gap > 0)
            last["next"] = row["first"] + row["samples"]
        yield from found.values()

    def _recording(self, row: dict[str, Any], number: int) -> Row:
        same = ("trial", "attempt", "stream", "channels", "units", "rate_hz")
        return {**self._who(), **{name: row[name] for name in same}, "recording": number, "next": 0,
                "start_s": row["t0_ns"] / NS - (row["first"] / row["rate_hz"] if row["rate_hz"] else 0.0),
                "samples": 0, "lost": 0, "gaps": 0}  # fmt: skip

    def _who(self) -> Row:
        return {"participant": self.sat.participant, "session": self.sat.number}

    def _of_trial(self, number: int | None, attempt: int | None) -> Row:
        """What the rows of a trial share; outside trials nothing but who."""
        if number is None or attempt is None:
            return {**self._who(), "trial": None}
        about = _about(self.trials_by_number[number])
        return {**self._who(), **about, "attempt": attempt, "onset_s": self.onsets.get((number, attempt))}


def _about(trial: dict[str, Any]) -> Row:
    same = {name: trial[name] for name in ("trial", "block", "stimulus")}
    return {**same, "practice": bool(trial["practice"])}

"""Records one small session of each shipped study: `python -m tests.recorded.make_ten [STUDY ...]`.

Only for a new study or a new ledger format beside the old one: a recorded session is there to stay as it is.
The expected tables are made from the ledgers by plain sqlite3 and json, not by Palpate's own tables.
"""

from __future__ import annotations

import csv
import hashlib
import json
import shutil
import sqlite3
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.protocols.events import Aside, Ask, Reply, Request
from palpate.protocols.plan import Plan
from palpate.studies.sessions.rig import Rig, RigPlan
from palpate.studies.sessions.session import resume, start
from palpate.studies.simulation.rig import simulated
from tests.studies.labs import stopping
from tests.studies.shipped import TEN, plan_for, read_shipped

HERE = Path(__file__).resolve().parent
SEED, SEEDS = 3, {"door_ratings": 5}
"""With seed 5 the participant of door_ratings goes back once."""
INTERRUPTED = {"texture_ratings": 41, "door_authoring": 6}
"""Stopped by a signal at this act, and resumed."""
ASIDES: dict[str, tuple[int, tuple[dict[str, Any], ...]]] = {
    "texture_adjectives": (9, ({"do": "repeat", "which": "last"},)),
    "texture_similarity": (7, ({"do": "pause"}, {"do": "note", "text": "the stylus had slipped"}, {"do": "go_on"})),
    "door_matching": (5, ({"do": "repeat", "which": "this"},)),
}
"""What the experimenter does while this question is being answered."""
COLUMNS = {
    "responses": "session trial attempt attribute value response_time_s revised counts",
    "words": "session seq n form trial attempt kind word counts",
    "answers": "session seq item form value number",
    "switches": "session seq n trial side at_s",
    "streams": "session seq block trial stream channels units rate_hz t0_ns samples sha256",
}
WORDS = ("adjectives", "lexicon", "suggestions")


def main(names: list[str]) -> None:
    """Record the named studies, or all; then write the expected tables of all."""
    for name in names or TEN:
        with tempfile.TemporaryDirectory() as lab:
            shutil.copy(recorded(name, Path(lab)), HERE / "ten")
    for table, columns in COLUMNS.items():
        with (HERE / "expected" / "ten" / f"{table}.csv").open("w", newline="") as file:
            rows = csv.DictWriter(file, columns.split(), lineterminator="\n")
            rows.writeheader()
            for path in sorted((HERE / "ten").glob("*.sqlite")):
                rows.writerows(expected(path)[table])


def recorded(name: str, lab: Path) -> Path:
    """Run a session, with what happens to it."""
    plan, rig = plan_for(name, seed=SEEDS.get(name, SEED)), meddling(name)
    result = start(lab, plan, stopping(rig, INTERRUPTED[name]) if name in INTERRUPTED else rig)
    return result.path if result.complete else resume(result.path, rig).path


@dataclass
class Meddled:
    """A world, and an experimenter who does something at the n-th question."""

    rig: Rig
    at: int
    does: list[dict[str, Any]]

    def now(self) -> int:
        return self.rig.world.now()

    def perform(self, request: Request) -> Reply | Aside:
        self.at -= isinstance(request, Ask) and self.at > 0
        if self.at == 0 and self.does:
            return Aside(self.does.pop(0))
        return self.rig.world.perform(request)


def meddling(name: str) -> RigPlan:
    """The study's simulated rig, and its experimenter."""
    study_files = read_shipped(name)
    rig = simulated(study_files.study, study_files.folder)
    if name not in ASIDES:
        return rig
    at, does = ASIDES[name]

    def opened(plan: Plan, t_ns: int) -> Rig:
        opened_rig = rig.open(plan, t_ns)
        return replace(opened_rig, world=Meddled(opened_rig, at, list(does)))

    return replace(rig, open=opened)


def expected(path: Path) -> dict[str, list[dict[str, Any]]]:
    """The rows of every table of COLUMNS, read from a ledger by itself."""
    with closing(sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)) as file:
        events = file.execute("SELECT seq, kind, trial, attempt, body FROM events ORDER BY seq").fetchall()
        blocks = file.execute("SELECT seq, block, stream, form, data FROM samples ORDER BY seq, block").fetchall()
    head = json.loads(events[0][4])
    session = {"session": f"{head['study']['study']}/{head['participant']}/{head['session']}"}
    tables: dict[str, list[dict[str, Any]]] = {table: [] for table in COLUMNS}
    request: dict[str, Any] = {}
    trials = {seq: trial for seq, _, trial, _, _ in events}
    for seq, kind, trial, attempt, body in events:
        value = json.loads(body)
        if kind == "request":
            request = value
        elif kind == "trial_ended" and value["as"] == "repeated":
            withdraw(tables, trial)
        elif kind == "experimenter" and value.get("which") == "last":
            withdraw(tables, trial - 1)
        elif kind == "reply" and request["do"] == "ask" and "answers" in value and "go" not in value:
            if trial is not None:
                withdraw(tables, trial)
            at = {"seq": seq, "trial": trial, "attempt": attempt}
            for table, row in unfolded(request, value, at):
                tables[table].append({**session, **row})
    for seq, block, stream, form, data in blocks:
        tables["streams"].append({**session, **streamed(json.loads(form), data), "seq": seq, "block": block,
                                 "trial": trials[seq], "stream": stream})  # fmt: skip
    return {table: sorted(rows, key=key_of(table)) for table, rows in tables.items()}


def withdraw(tables: dict[str, list[dict[str, Any]]], trial: int) -> None:
    """Mark the answers of a trial as not counting, because it is answered again."""
    for row in (*tables["responses"], *tables["words"]):
        if row["trial"] == trial:
            row["counts"] = 0


def key_of(table: str) -> Any:
    """The order of the collected database: that of the keys."""
    keys = ("trial", "attempt", "attribute") if table == "responses" else ("seq", "n", "block", "item")
    return lambda row: tuple(row[key] for key in keys if key in row)


def unfolded(
    request: dict[str, Any], value: dict[str, Any], at: dict[str, Any]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """The rows that one answered form makes, each with its table."""
    seq, answers = at["seq"], value["answers"]
    if request["form"] in WORDS:
        given = [(kind, word) for kind, words in answers.items() for word in words]
        for n, (kind, word) in enumerate(given):
            yield "words", {**at, "n": n, "form": request["form"], "kind": kind, "word": word, "counts": 1}
    elif at["trial"] is None:
        for item in request["items"]:
            answer, number = (
                answers[item],
                isinstance(answers[item], int | float) and not isinstance(answers[item], bool),
            )
            text = answer if isinstance(answer, str) else json.dumps(answer)
            yield "answers", {"seq": seq, "item": item, "form": request["form"], "value": text,
                              "number": float(answer) if number else ""}  # fmt: skip
    else:
        revised = int(request["previous"] is not None)
        for item in request["items"]:
            yield "responses", {"trial": at["trial"], "attempt": at["attempt"], "attribute": item,
                                "value": float(answers[item]), "response_time_s": value["at_s"][item],
                                "revised": revised, "counts": 1}  # fmt: skip
    for n, switch in enumerate(value.get("switches", ())):
        yield "switches", {"seq": seq, "n": n, "trial": at["trial"], "side": switch["to"], "at_s": switch["at_s"]}


def streamed(form: dict[str, Any], data: bytes) -> dict[str, Any]:
    """What a sample block is, and the digest of its bytes."""
    return {
        "channels": ",".join(form["channels"]), "units": ",".join(form["units"]), "rate_hz": form["rate_hz"],
        "t0_ns": form["t0_ns"], "samples": len(data) // (4 * len(form["channels"])),
        "sha256": hashlib.sha256(data).hexdigest(),
    }  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1:])

"""Labs to export from: recorded sessions as they are, or with other answers in them."""

from __future__ import annotations

import csv
import shutil
from dataclasses import replace
from pathlib import Path

from palpate.analysis.exporting.export import Choices, export
from palpate.analysis.ratings.sources import DataRequest
from palpate.protocols.canonical import canonical
from palpate.protocols.forms import LabForms
from palpate.protocols.plan import compile_plan
from palpate.protocols.study import Study
from palpate.protocols.trial import ParticipantRow
from palpate.studies.sessions.ledger import create, open_for_append
from palpate.studies.sessions.record import read

RECORDED = Path(__file__).parents[2] / "recorded"
AT = {"at": "1987-06-05T04:03:02+00:00"}


def lab_of(folder, *studies):
    """A lab that holds the recorded sessions of these studies."""
    (folder / "sessions").mkdir(parents=True, exist_ok=True)
    for study in studies:
        for path in (path for part in ("ten", "sessions") for path in RECORDED.glob(f"{part}/{study}_P*_s1.sqlite")):
            shutil.copy(path, folder / "sessions")
    return folder


def exported(lab, study, to, fmt, *, include_incomplete=False, simulated=None, url=None, **choices):
    """What `palpate export --least-people 1` does."""
    request = DataRequest(study, lab, url, None, include_incomplete, simulated)
    return export(request, to, Choices(fmt, **{"least_people": 1, **choices}))


def read_rows(path):
    """Return the rows of a CSV file, each a dict of its cells by column."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def rewritten(source, to, change=lambda kind, body: body, header=None, upto=None):
    """The session anew, each event's body as `change` makes it; the chain is as the product's own ledger links it."""
    record = read(source)
    merged = {**record.header, **(header or {})}
    who = ParticipantRow(merged["participant"], merged["group"], merged["row"])
    forms = LabForms.from_definition(merged["lab_forms"]) if "lab_forms" in merged else None
    plan = compile_plan(Study.model_validate(merged["study"]), who, merged["seed"], forms)
    create(to, {**merged, "plan": plan.digest}, AT)
    ledger = open_for_append(to, AT)
    try:
        for event in record.events[1:upto]:
            ledger.append(replace(event, body=canonical(change(event.kind, event.value))))
    finally:
        ledger.close({"at": "2026-01-01T00:00:00+00:00", "because": "complete"})
    return read(to)


def answering(**answers):
    """A `change`: these answers instead of those that were given to the same questions."""

    def change(kind, body):
        if kind == "reply" and answers.keys() & body.get("answers", {}).keys():
            return {
                **body,
                "answers": {**body["answers"], **{k: v for k, v in answers.items() if k in body["answers"]}},
            }
        return body

    return change

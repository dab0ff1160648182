"""The words that files on disk hold, collected from the code that writes and reads them and from recorded files."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
import types
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from sqlalchemy import MetaData

from palpate.analysis.figures.figure_kind import FigureSettings
from palpate.analysis.importing import map_file
from palpate.analysis.plans.answers import StatisticSettings
from palpate.analysis.plans.kinds import FIGURES, TESTS
from palpate.analysis.plans.reading import AnalysisPlan
from palpate.devices.actuator.calibration import Calibration
from palpate.devices.author.designs import Design, StoredWork
from palpate.devices.device import FAULTS
from palpate.devices.kinds import KINDS
from palpate.devices.rig import file as rig_file
from palpate.devices.window import calibration as window
from palpate.modeling.attributes import model_file
from palpate.modeling.library.entries import Library
from palpate.protocols import event_shapes, events
from palpate.protocols.fields import KINDS as QUESTIONS
from palpate.protocols.intervals import Intervals
from palpate.protocols.needs import NEEDS, Need, needs_with
from palpate.protocols.procedures import KINDS as PROCEDURES
from palpate.protocols.study import Study
from palpate.protocols.tasks import TASKS
from palpate.signals.models.card import Card
from palpate.studies import lab
from palpate.studies.collecting import schema as collected_schema
from palpate.studies.participants import identities
from palpate.studies.participants import schema as registry
from palpate.studies.sessions import ledger_schema

Words = dict[str, set[str]]
"""The words of one group, by the place in a file that they stand at."""
TESTS_FOLDER = Path(__file__).resolve().parent
RECORDED = TESTS_FOLDER / "recorded"
TEMPLATE = TESTS_FOLDER.parent / "participants_template"
NAMES_OF_A_STUDY = {"answers", "previous", "wish", "at_s", "streams", "packages", "columns", "groups", "latents"}
"""Keys whose own keys are names that a study or a lab gives."""
ELSEWHERE = {"study", "devices", "settings", "questions"}
"""Keys of a ledger whose content is another group's, or a lab's own."""
ATTRIBUTES = {"Flat", "Hard", "Rough", "Sticky"}
"""Names of a recorded study that a statistic has as columns."""
CLOSED = {"do", "which", "as", "go", "page", "kind", "by", "because"}
"""Keys of events whose values are words of ours."""


def of_models(**models: type[BaseModel]) -> Words:
    """Return the keys of models and of those within them, by their paths, and the values that a key may have.

    A model that is used twice, and what a model inherits from one before it, stand where they are met first.
    """
    words: Words = defaultdict(set)
    seen = set[type[BaseModel]]()
    for name, model in models.items():
        _add_model(words, name, model, seen)
    return words


def _add_model(words: Words, place: str, model: type[BaseModel], seen: set[type[BaseModel]]) -> None:
    if model in seen:
        return
    inherited = {name for base in model.__mro__[1:] if base in seen for name in base.model_fields}
    seen.add(model)
    for name, field in model.model_fields.items():
        if name in inherited:
            continue
        words[place].add(name)
        if field.validation_alias is not None:
            words[place] |= set(map(str, getattr(field.validation_alias, "choices", [field.validation_alias])))
        for part in _parts(field.annotation):
            if isinstance(part, type):
                step = part.model_fields.get("do")
                _add_model(words, f"step {step.default}" if step else f"{place}.{name}", part, seen)
            elif name != "do":
                words[f"{place}.{name} ="].add(part)


def _parts(annotation: Any) -> Iterator[type[BaseModel] | str]:
    """Yield the models and the literal texts within an annotation."""
    if isinstance(annotation, type) and not get_args(annotation) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) is Literal:
        yield from (value for value in get_args(annotation) if isinstance(value, str))
    elif isinstance(annotation, types.GenericAlias) or get_args(annotation):
        for part in get_args(annotation):
            yield from _parts(part)


def of_tables(metadata: MetaData) -> Words:
    """Return the columns of each table."""
    return {table.name: {column.name for column in table.columns} for table in metadata.tables.values()}


def of_files(pattern: str, place: str) -> Words:
    """Return the keys at the top of recorded JSON files, and of the lists and objects right below."""
    words: Words = defaultdict(set)
    for path in RECORDED.glob(pattern):
        data = json.loads(path.read_text(encoding="utf-8"))
        words[place] |= set(data)
        for key, value in data.items():
            for part in value if isinstance(value, list) else [value]:
                if isinstance(part, dict):
                    words[f"{place}.{key}"] |= set(part)
        for test in data["tests"]:
            words[f"{place}.tests.missing"] |= set(test.get("missing") or {})
            words[f"{place}.tests.kinds of {test['test']}"] |= set(test.get("kinds") or {}) - ATTRIBUTES
    return words


@cache
def of_ledgers(copies: Path) -> dict[str, Words]:
    """Return the words of all recorded ledgers: keys of events, what ours stand there, streams, tables.

    A ledger that was killed is copied to `copies` first, for SQLite writes into one that it opens.
    """
    words: dict[str, Words] = {"keys": defaultdict(set), "values": defaultdict(set), "tables": defaultdict(set)}
    for path in sorted(RECORDED.rglob("*_s[0-9].sqlite")):
        with closing(_opened(path, copies)) as file:
            for (table,) in file.execute("SELECT name FROM sqlite_master WHERE type = 'table'"):
                words["tables"][table] |= {row[1] for row in file.execute(f"PRAGMA table_info({table})")}
            for kind, body in file.execute("SELECT DISTINCT kind, body FROM events"):
                words["values"]["events.kind"].add(kind)
                _add_body(words, kind, json.loads(body))
            for kind, body in file.execute("SELECT DISTINCT kind, body FROM sittings"):
                words["values"]["sittings.kind"].add(kind)
                _add_body(words, kind, json.loads(body))
            for stream, form in file.execute("SELECT DISTINCT stream, form FROM samples"):
                stream_form = json.loads(form)
                words["keys"]["samples.form"] |= set(stream_form)
                words["values"][f"channels of {stream}"] |= set(stream_form["channels"])
                words["values"]["units"] |= {unit.replace(" ", "*") for unit in stream_form["units"]}
    return words


def _opened(path: Path, copies: Path) -> sqlite3.Connection:
    log = path.with_name(f"{path.name}-wal")
    if not log.exists():
        return sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)
    for file in (path, log):
        shutil.copy(file, copies)
    return sqlite3.connect(copies / path.name)


def _add_body(words: dict[str, Words], kind: str, body: Any) -> None:
    if kind in {"request", "experimenter"}:
        kind = f"{kind} {body['do']}"
        words["values"]["ask.form"] |= {body["form"]} if "form" in body else set()
    _add_keys(words, kind, body)


def _add_keys(words: dict[str, Words], place: str, value: Any) -> None:
    for part in value if isinstance(value, list) else [value]:
        if isinstance(part, dict):
            words["keys"][place] |= set(part)
            for key, inner in part.items():
                if key in CLOSED and isinstance(inner, str) and " " not in inner:
                    words["values"][f"{place.split(' ', maxsplit=1)[0]}.{key}"].add(inner)
                if key not in NAMES_OF_A_STUDY | ELSEWHERE and isinstance(inner, dict | list):
                    _add_keys(words, f"{place}.{key}", inner)


def of_events(copies: Path) -> Words:
    """Return the keys of events: those of recorded ones, and those that today's checks and requests know."""
    words: Words = defaultdict(set)
    for kind, (needed, others) in event_shapes._BODIES.items():
        words[kind] |= {*needed, *others}
    for do, needed in event_shapes._REQUESTS.items():
        words[f"request {do}"] |= set(needed)
    for request in (events.Confirm("setup 1", "text"), events.Rest(1, 2), events.Instruct("instructions")):
        words[f"request {request.body()['do']}"] |= set(request.body())
    for place, keys in of_ledgers(copies)["keys"].items():
        words[place] |= keys
    return words


def of_ledger_tables(copies: Path) -> Words:
    """Return the tables of a ledger by today's code, and those of recorded ones."""
    words = of_tables(ledger_schema.metadata)
    return {table: words.get(table, set()) | of_ledgers(copies)["tables"].get(table, set()) for table in words}


def of_collected() -> Words:
    """Return the tables of the collected database, and the columns of its view of ratings."""
    view = {column.name for column in collected_schema.ratings_query().selected_columns}
    return of_tables(collected_schema.metadata) | {collected_schema.RATINGS: view}


def of_studies() -> Words:
    """Return the keys of a study, which its plan and its digest are made of, and the names of tasks and needs."""
    names = {"tasks": set(TASKS), "study.task =": set(TASKS), "study.needs =": set(NEEDS)}
    settings = {f"settings of {name}": task.settings for name, task in TASKS.items() if task.settings is not None}
    loaded = {"study.intervals": Intervals}
    loaded |= {f"study.procedure {name}": schema for name, schema in PROCEDURES.items()}
    loaded |= {f"study.ask {name}": schema for name, schema in QUESTIONS.items()}
    return of_models(study=Study, **settings, **loaded) | names | {"study.capture.device =": set(needs_with("records"))}


def of_participants() -> Words:
    """Return what a lab's own files about participants hold."""
    header, *_ = (TEMPLATE / "participants.tsv").read_text(encoding="utf-8").splitlines()
    sidecar = json.loads((TEMPLATE / "participants.json").read_text(encoding="utf-8"))
    return {
        "participants.tsv": set(header.split("\t")),
        "participants.json": set(sidecar) | {key for column in sidecar.values() for key in column},
        "lab.yaml": set(lab._KEYS),
        **of_tables(registry.metadata),
        identities.table.name: {column.name for column in identities.table.columns},
    }


def of_stations() -> Words:
    """Return what a station's files hold: window.yaml, rig.yaml, and the calibration of a voice coil."""
    return {
        "window.yaml": set(window.KEYS),
        "rig.yaml": set(rig_file.KEYS),
        "rig.yaml needs": {name for name, need in NEEDS.items() if need.takes},
        **{f"streams of {name}": streams for name, need in NEEDS.items() if (streams := of_streams(need))},
        **of_models(**{f"rig.yaml {kind}": KINDS[kind].settings for kind in KINDS}, vibration=Calibration),
    }


def of_streams(need: Need) -> set[str]:
    """Return the names that a need gives to streams."""
    return {taken.stream for taken in need.takes.values()} - {""}


def of_analysis_plans() -> Words:
    """Return the keys of an analysis plan, and of each kind of test and figure."""
    tests = {f"test {name}": TESTS[name].settings for name in TESTS}
    figures = {f"figure {name}": FIGURES[name].settings for name in FIGURES}
    return of_models(plan=AnalysisPlan, test=StatisticSettings, figure=FigureSettings, **tests, **figures)


def of_models_on_disk() -> Words:
    """Return the keys of the cards of models, of designs, of a library and of a map for importing."""
    return of_models(
        card=Card,
        attributes=model_file.Card,
        design=Design,
        authoring=StoredWork,
        library=Library,
        map=map_file.ColumnMap,
    )


def of_faults() -> Words:
    """Return the words that faults are counted by."""
    return {"fault.what": set(FAULTS)}


@cache
def words_in_code() -> frozenset[str]:
    """Return all words of the product that are quoted, or that are a key or a field of something."""
    quoted = re.compile(r"""["'](\w+)["']|\b(\w+)(?:=|: )""")
    folders = [TEMPLATE.parent / name for name in ("protocols", "signals", "devices", "studies")]
    paths = [path for folder in folders for path in folder.rglob("*.py")]
    matches = (quoted.findall(path.read_text(encoding="utf-8")) for path in paths)
    return frozenset(word for pairs in matches for pair in pairs for word in pair if word)


def words_in(text: str) -> Words:
    """Return the words of a group as tests/frozen_words.py has them: `place: word word`; an indented line goes on."""
    words: Words = {}
    for line in re.sub(r"\n\s+", " ", text.strip()).splitlines():
        place, _, listed = line.partition(": ")
        words[place] = set(listed.split())
    return words


def text_of(words: Words) -> str:
    """Return a group as tests/frozen_words.py is to have it."""
    return "\n".join(_lines(words))


def _lines(words: Words) -> Iterable[str]:
    for place in sorted(words):
        line = f"{place}:"
        for word in sorted(words[place]):
            if len(line) + len(word) > 118:
                yield line
                line = "   "
            line += f" {word}"
        if words[place]:
            yield line

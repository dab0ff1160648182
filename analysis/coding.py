"""Coders' tables of free answers: how often each code was used, and how well two coders agree on it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from palpate.analysis.exporting.session_rows import SessionRows
from palpate.analysis.exporting.source import Source
from palpate.analysis.importing.dialects import Sheet, TableRefused, read_sheet
from palpate.analysis.reliability.kappa import cohen_kappa
from palpate.protocols.did_you_mean import nearest
from palpate.protocols.lookalikes import looks

EVERY = "(all)"
"""The label for all questions, and for all codes where each answer has exactly one."""
Row = dict[str, Any]
FORM = "interview"
BETWEEN = ";"
"""The separator of the codes of one answer."""
CODES = ("codes", "code")


def code_counts(coders: Sequence[Coder], answers: Sequence[Answer]) -> list[Row]:
    """Return one row per question, code and coder: the numbers of answers and people with it, and of coded answers."""
    return [
        {
            "item": item, "code": code, "coder": coder.name, "answers": len(having), "coded": len(coded),
            "share": len(having) / len(coded) if coded else math.nan,
            "people": len({answer.participant for answer in having}),
        }
        for item, of_question in _questions(answers)
        for code in _codes(coders, of_question)
        for coder in coders
        for coded in [[answer for answer in of_question if answer in coder.codes]]
        for having in [[answer for answer in coded if code in coder.codes[answer]]]
    ]  # fmt: skip


def agreement(coders: Sequence[Coder], answers: Sequence[Answer]) -> list[Row]:
    """Return one row per pair of coders, question and code: Cohen's kappa of the code's use, with a 95 % CI.

    Only answers that both have coded count. If both gave exactly one code to each answer of a question, a row `(all)`
    has the kappa over all codes.
    """
    rows = []
    for first, second in combinations(coders, 2):
        for item, of_question in _questions(answers):
            both = [answer for answer in of_question if answer in first.codes and answer in second.codes]
            for code in _codes((first, second), both):
                pairs = [(code in first.codes[answer], code in second.codes[answer]) for answer in both]
                rows.append(_row(first, second, item, code, pairs))
            if both and all(len(coder.codes[answer]) == 1 for coder in (first, second) for answer in both):
                single = [(min(first.codes[answer]), min(second.codes[answer])) for answer in both]
                rows.append(_row(first, second, item, EVERY, single))
    return rows


def notes_on(coders: Sequence[Coder], answers: Sequence[Answer]) -> Iterator[str]:
    """Yield notes on the answers that were not coded, and by whom."""
    if len(coders) == 1:
        yield "one coder: how far coders agree takes a second table (--codes)"
    for coder in coders:
        if missing := [answer for answer in answers if answer not in coder.codes]:
            names = ", ".join(f"{uncoded.participant} {uncoded.item}" for uncoded in missing[:3])
            more = ", ..." if len(missing) > 3 else ""
            yield f"{coder.name}: {len(missing)} of {len(answers)} answers were not coded ({names}{more})"


def _row(first: Coder, second: Coder, item: str, code: str, pairs: Sequence[tuple[Any, Any]]) -> Row:
    levels = sorted({level for pair in pairs for level in pair} | ({False, True} if code != EVERY else set()))
    counts = np.array([[pairs.count((one, other)) for other in levels] for one in levels])
    kappa = cohen_kappa(counts)
    return {
        "item": item, "code": code, "coder_a": first.name, "coder_b": second.name, "answers": kappa.units,
        "agreed": int(np.trace(counts)), "agreement": kappa.agreement, "kappa": kappa.kappa, "se": kappa.se,
        "ci95_low": kappa.low, "ci95_high": kappa.high, "note": kappa.note,
    }  # fmt: skip


def _questions(answers: Sequence[Answer]) -> list[tuple[str, list[Answer]]]:
    """Return each question with its answers, and last all together if there are several questions."""
    items = list(dict.fromkeys(answer.item for answer in answers))
    questions = [(item, [answer for answer in answers if answer.item == item]) for item in items]
    return [*questions, (EVERY, list(answers))] if len(items) > 1 else questions


def _codes(coders: Sequence[Coder], answers: Sequence[Answer]) -> list[str]:
    return sorted({code for coder in coders for answer in answers for code in coder.codes.get(answer, ())})


@dataclass(frozen=True, order=True)
class Answer:
    """An answer in free text with its participant, session and question."""

    participant: str
    session: int
    item: str


@dataclass(frozen=True)
class Coder:
    """A coder's table: its file, and the codes (possibly none) of each answer that it has a row for."""

    name: str
    sha256: str
    codes: Mapping[Answer, frozenset[str]]


def answers_in(source: Source) -> list[Answer]:
    """Return every free-text answer that is not empty, by participant, session and question."""
    return [
        Answer(session.participant, session.number, str(row["item"]))
        for session in source.sessions
        for row in SessionRows(source, session).answers()
        if row["form"] == FORM and row["value"]
    ]


def read_coders(paths: Sequence[Path], answers: Sequence[Answer]) -> tuple[Coder, ...]:
    """Read the coders' tables: CSV with `participant`, `item`, `codes`, and `session` if somebody had several.

    Further columns, such as those of an export, are ignored; codes of one answer are separated by `;`, and a row
    without a code says that none fits. Raises TableRefused, with file and line, on a row that is no answer of the
    study, a duplicate answer or file, and codes that differ only in spelling.
    """
    if len({path.resolve() for path in paths}) < len(paths):
        raise TableRefused("--codes: one table is named twice; each coder has one of their own")
    # Coders are named by their files, with the folder where two have the same name.
    stems = [path.stem for path in paths]
    coders_names = [f"{path.parent.name}/{path.stem}" if stems.count(path.stem) > 1 else path.stem for path in paths]
    tables = []
    for path, name in zip(paths, coders_names, strict=True):
        if not path.is_file():
            raise TableRefused(
                f"{path}: no such file; a coder's table is expected, as palpate export --free-text gives it"
            )
        sheet = read_sheet(
            path, path.name, encodings=("utf-8",), delimiter=None, required=("participant", "item"), trim=True
        )
        codes: dict[Answer, frozenset[str]] = {}
        for where, answer, own_codes in _rows(sheet, answers):
            if answer in codes:
                raise TableRefused(
                    f"{where}: {_described(answer)} appears twice; put all its codes into one row, separated by ;"
                )
            codes[answer] = own_codes
        tables.append(Coder(name, sheet.sha256, codes))
    coders = tuple(tables)
    # Two codes that look alike are refused: coders would then differ in spelling alone.
    alike: dict[str, dict[str, str]] = {}
    for coder in coders:
        for code in sorted({code for codes in coder.codes.values() for code in codes}):
            alike.setdefault(looks(code), {}).setdefault(code, coder.name)
    for spellings in alike.values():
        if len(spellings) > 1:
            listing = " and ".join(f"{code!r} ({name})" for code, name in spellings.items())
            raise TableRefused(f"codes that look alike: {listing}; write one code in one way")
    return coders


def _rows(sheet: Sheet, answers: Sequence[Answer]) -> Iterator[tuple[str, Answer, frozenset[str]]]:
    """Yield (file and line, answer, codes) of each row of free text."""
    column = next((name for name in CODES if name in sheet.header), None)
    if column is None:
        columns = ", ".join(sheet.header)
        raise TableRefused(f"{sheet.name}: a column `codes` is expected, with the codes apart by ;; it has {columns}")
    form = sheet.place("form") if "form" in sheet.header else None
    number = sheet.place("session") if "session" in sheet.header else None
    known = set(answers)
    for row in sheet.rows:
        where = f"{sheet.name}: line {row.line}"
        codes = frozenset(code.strip() for code in row.cells[sheet.place(column)].split(BETWEEN) if code.strip())
        if form is not None and row.cells[form] != FORM and not codes:
            continue
        participant, item = (row.cells[sheet.place(name)] for name in ("participant", "item"))
        # The number of the session; where the table has none, the participant's only one.
        text = None if number is None else row.cells[number]
        if text:
            if not text.isdecimal():
                raise TableRefused(f"{where}: session {text!r}: the number of a session is expected, from 1")
            session = int(text)
        else:
            sessions = {answer.session for answer in answers if answer.participant == participant}
            if len(sessions) > 1:
                listing = ", ".join(map(str, sorted(sessions)))
                raise TableRefused(f"{where}: {participant} had sessions {listing}: say which in a column `session`")
            session = next(iter(sessions), 1)
        answer = Answer(participant, session, item)
        if form is not None and not codes and answer not in known:
            continue  # of an export: nothing was answered there
        if answer not in known:
            people = sorted({other.participant for other in answers})
            items = sorted({other.item for other in answers if other.participant == answer.participant})
            near = nearest(answer.item, items) if items else nearest(answer.participant, people)
            raise TableRefused(f"{where}: {_described(answer)} is not an answer in free text; {near}")
        yield where, answer, codes


def _described(answer: Answer) -> str:
    return f"{answer.participant}, session {answer.session}, {answer.item!r}"

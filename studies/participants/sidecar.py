"""participants.json: the meaning of each column of the table of participants (BIDS), and the questions for them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from difflib import get_close_matches
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

from palpate.protocols.forms import Question
from palpate.studies.lab import SIDECAR, TEMPLATE, ParticipantError

IDENTIFYING = frozenset(
    word
    for line in (
        "name names surname forename firstname lastname fullname nickname initials signature photo",
        "email mail phone telephone mobile contact kakao address street postcode postal zip",
        "birth birthday birthdate born dob passport ssn iban",
        "이름 성명 성함 연락처 전화 전화번호 휴대폰 이메일 주소 생일 생년월일 주민등록번호 학번",
    )
    for word in line.split()
)
"""Words that no column's name may have: nothing that identifies a person enters a ledger, a table or an export."""
_TEXTS = ("LongName", "Description", "Units", "Question", "TermURL", "Delimiter", "Format")
_MAPPINGS = ("Levels",)
_NUMBERS = ("Minimum", "Maximum")
_SWITCHES = ("Optional",)
_KNOWN = (*_TEXTS, *_MAPPINGS, *_NUMBERS, *_SWITCHES, "HED", "Derivative")
_TRANSLATED = re.compile(r"^(Question|Levels|Units|LongName)_([a-z]{2,3}(?:-[A-Za-z0-9]+)*)$")
_NAME = re.compile(r"^[a-z][a-z0-9_]{0,63}$")

Columns = dict[str, dict[str, Any]]


def sidecar_file(lab: Path | None) -> Path:
    """Return the lab's participants.json, or the template's where there is no lab or it has none."""
    own = lab / SIDECAR if lab is not None else None
    return own if own is not None and own.is_file() else TEMPLATE / SIDECAR


def columns(file: Path) -> Columns:
    """Return the columns by name in the file's order, participant_id first.

    Raises ParticipantError with file, key and expectation: on invalid JSON, a value of the wrong kind, an invalid name
    of a column, a column that would identify somebody.
    """
    data = _parsed(file)
    if not isinstance(data, dict) or next(iter(data), None) != "participant_id":
        raise ParticipantError(f'{file}: an object with "participant_id" as its first key is expected')
    for name, column in data.items():
        where = f"{file}: {name}"
        if word := identifying(name):
            raise ParticipantError(
                f"{where}: a column about {word!r} would identify a person; identities are stored separately "
                "(palpate participants identify); rename the column if it does not"
            )
        if not _NAME.fullmatch(name):
            raise ParticipantError(f"{where}: a column's name in snake_case is expected, as driving_experience")
        if not isinstance(column, dict):
            raise ParticipantError(f"{where}: found {column!r:.60}, an object with Description is expected")
        for key, value in column.items():
            _demand_value(f"{where}.{key}", key, value)
        low, high = column.get("Minimum"), column.get("Maximum")
        if low is not None and high is not None and low > high:
            raise ParticipantError(f"{where}: Minimum ({low}) is above Maximum ({high})")
    return data


def identifying(name: str) -> str | None:
    """Return the word in a column's name that would identify somebody, or None."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = re.split(r"[\W_0-9]+", spaced.casefold())
    pairs = [first + second for first, second in pairwise(words)]
    return next((word for word in (*words, *pairs) if word in IDENTIFYING), None)


def _parsed(file: Path) -> Any:
    try:
        text = file.read_text("utf-8-sig")
        return json.loads(text, object_pairs_hook=_once_each, parse_constant=partial(_demand_finite, file))
    except UnicodeDecodeError as error:
        raise ParticipantError(f"{file}: byte {error.start} is not UTF-8; save the file as UTF-8") from None
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise ParticipantError(f"{file}: {where}: this is not JSON ({error.msg})") from None
    except KeyError as error:
        raise ParticipantError(f"{file}: the key {error.args[0]!r} appears twice in one object") from None
    except RecursionError:
        raise ParticipantError(f"{file}: nested too deeply") from None


def _demand_finite(file: Path, constant: str) -> None:
    raise ParticipantError(f"{file}: {constant} is not JSON; a finite number is expected")


def _once_each(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    pairs_by_key: dict[str, Any] = {}
    for key, value in pairs:
        if key in pairs_by_key:
            raise KeyError(key)
        pairs_by_key[key] = value
    return pairs_by_key


def _demand_value(where: str, key: str, value: Any) -> None:
    translated = _TRANSLATED.fullmatch(key)
    plain = translated[1] if translated else key
    if plain in _TEXTS and not (isinstance(value, str) and value.strip()):
        raise ParticipantError(f"{where}: found {value!r:.60}, a text is expected")
    if plain in _MAPPINGS and not (isinstance(value, Mapping) and value and all(map(level_label, value.values()))):
        raise ParticipantError(f'{where}: found {value!r:.60}, an object is expected, as {{"F": "Woman"}}')
    if plain in _NUMBERS and type(value) not in (int, float):
        raise ParticipantError(f"{where}: found {value!r:.60}, a number is expected")
    if plain in _SWITCHES and type(value) is not bool:
        raise ParticipantError(f"{where}: found {value!r:.60}, true or false is expected")
    if plain not in _KNOWN and (meant := get_close_matches(key, _KNOWN, n=1, cutoff=0.8)):
        raise ParticipantError(f"{where}: unknown key; did you mean {meant[0]!r}?")


def level_label(label: Any) -> str | None:
    """Return the label of a level, None if it has none; BIDS allows a text or an object with a Description."""
    text = label.get("Description") if isinstance(label, Mapping) else label
    return text if isinstance(text, str) and text.strip() else None


def questions(lab: Path | None, language: str = "en") -> tuple[Question, ...]:
    """Return a question in a language for every column that has a `Question`, in the file's order.

    A column with `Levels` is a choice, one with `Units`, `Minimum` or `Maximum` a number, any other a text.
    Answers are voluntary unless the column says "Optional": false.
    Raises ParticipantError on a broken file or a missing translation, naming file and key.
    """
    file = sidecar_file(lab)
    with_question = ((name, column) for name, column in columns(file).items() if "Question" in column)
    return tuple(question(f"{file}: {name}", name, column, language) for name, column in with_question)


def question(where: str, name: str, column: dict[str, Any], language: str = "en") -> Question:
    """Return one column's question; `where` is its place for messages."""
    kind: Literal["number", "choice", "text"] = "text"
    if "Levels" in column:
        kind = "choice"
    elif {"Units", "Minimum", "Maximum"} & set(column):
        kind = "number"
    return Question(
        name=name,
        text=_in(where, column, "Question", language),
        kind=kind,
        levels=_levels(where, column, language) if kind == "choice" else (),
        unit=_in(where, column, "Units", language) if "Units" in column else None,
        low=column.get("Minimum"),
        high=column.get("Maximum"),
        optional=column.get("Optional", True),
    )


def _levels(where: str, column: dict[str, Any], language: str) -> tuple[tuple[str, str], ...]:
    labels = _in(where, column, "Levels", language)
    if set(labels) != set(column["Levels"]):
        missing = ", ".join(sorted(set(column["Levels"]) ^ set(labels)))
        raise ParticipantError(f"{where}.Levels_{language}: the same levels as in Levels are expected ({missing})")
    return tuple((level, level_label(labels[level]) or level) for level in column["Levels"])


def _in(where: str, column: dict[str, Any], key: str, language: str) -> Any:
    """Return a key's value in the language; the plain key is the English one."""
    translated = key if language == "en" else f"{key}_{language}"
    if translated not in column:
        raise ParticipantError(f"{where}.{translated}: missing; a translation of {key} is expected")
    return column[translated]

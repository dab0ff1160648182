"""What files on disk hold is what tests/frozen_words.py lists: no word is renamed, and none is added by accident."""

from __future__ import annotations

import ast
import hashlib
import shutil
import sqlite3
from contextlib import closing

import pytest

from palpate.studies.sessions.ledger_schema import APPLICATION_ID, SEED
from tests import frozen_words as frozen
from tests import words_in_files as collected
from tests.recorded.make_frozen import LAB
from tests.words_in_files import of_ledgers, text_of, words_in, words_in_code

GROUPS = {
    "LEDGER_TABLES": collected.of_ledger_tables,
    "EVENT_KEYS": collected.of_events,
    "EVENT_VALUES": lambda copies: of_ledgers(copies)["values"],
    "FAULTS": lambda _copies: collected.of_faults(),
    "STUDIES": lambda _copies: collected.of_studies(),
    "COLLECTED": lambda _copies: collected.of_collected(),
    "PARTICIPANTS": lambda _copies: collected.of_participants(),
    "STATIONS": lambda _copies: collected.of_stations(),
    "MODELS": lambda _copies: collected.of_models_on_disk(),
    "ANALYSIS_PLANS": lambda _copies: collected.of_analysis_plans(),
    "STATISTICS": lambda _copies: collected.of_files("expected/regenerated/*/statistics.json", "statistics.json"),
}
PUT_TOGETHER = {f"{model}_{what}" for model in ("force", "perception") for what in ("model", "sha256")}
"""Words that the code puts together from two."""


@pytest.fixture(scope="module")
def copies(tmp_path_factory):
    return tmp_path_factory.mktemp("ledgers")


@pytest.mark.parametrize("group", GROUPS)
def test_the_words_in_files_are_the_frozen_ones(copies, group):
    now, then = (pairs(words) for words in (GROUPS[group](copies), words_in(getattr(frozen, group))))
    assert then - now == set(), f"{group} of tests/frozen_words.py: files of labs hold these, and nothing has them now"
    assert now - then == set(), f"{group} of tests/frozen_words.py lacks these: add them there, on purpose"


@pytest.mark.parametrize("group", ["EVENT_KEYS", "EVENT_VALUES", "LIVE_SESSIONS"])
def test_the_words_of_a_session_stand_in_the_code_that_runs_one(group):
    words = {word for words in words_in(getattr(frozen, group)).values() for word in words}
    assert {word for word in words if word.isidentifier()} - words_in_code() - PUT_TOGETHER == set()


def test_every_group_is_looked_at_and_says_why_it_is_frozen():
    assert {name for name in vars(frozen) if name.isupper()} == {*GROUPS, "LIVE_SESSIONS"}
    _, *statements = ast.parse((collected.TESTS_FOLDER / "frozen_words.py").read_text(encoding="utf-8")).body
    for group, reason in zip(statements[::2], statements[1::2], strict=True):
        assert isinstance(group, ast.Assign) and isinstance(reason, ast.Expr), ast.unparse(group)


def test_a_ledger_is_known_by_its_marks():
    assert APPLICATION_ID == 0x50414C50
    assert hashlib.sha256(b"palpate ledger").hexdigest() == SEED


def test_the_collected_database_of_the_frozen_lab_has_no_other_tables(tmp_path):
    with closing(sqlite3.connect(shutil.copy(LAB / "lab.sqlite", tmp_path))) as file:
        tables = [name for (name,) in file.execute("SELECT name FROM sqlite_master WHERE type IN ('table', 'view')")]
        held = {table: {row[1] for row in file.execute(f"PRAGMA table_info({table})")} for table in tables}
    assert pairs(held) <= pairs(words_in(frozen.COLLECTED))


def test_the_list_reads_as_it_is_written():
    for name in (*GROUPS, "LIVE_SESSIONS"):
        assert text_of(words_in(getattr(frozen, name))) == getattr(frozen, name).strip()


def pairs(words):
    return {(place, word) for place, words_there in words.items() for word in words_there}

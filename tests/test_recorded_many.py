"""CI regenerates eight studies from their recorded sessions: statistics to 1e-9, tables to the letter."""

import shutil

import pytest

from analysis.regenerating.checking import differences
from analysis.regenerating.files import file_texts
from analysis.regenerating.regenerated import regenerate
from analysis.reporting.sources import Wanted
from studies.record import read
from studies.replay import replay
from tests.recorded.make_many import EXPECTED, MANY, PEOPLE, texts_of

LEDGERS = sorted((MANY / "sessions").glob("*.sqlite"))


def test_all_sessions_are_there_and_none_is_large():
    assert len(LEDGERS) == sum(PEOPLE.values())
    assert sum(path.stat().st_size for path in LEDGERS) < 4_500_000


@pytest.mark.parametrize("path", LEDGERS, ids=lambda path: path.stem)
def test_a_recorded_session_repeats_event_by_event(path):
    found = replay(path)
    assert found.complete and found.events == len(read(path).events)


@pytest.mark.parametrize("name", PEOPLE)
def test_what_is_regenerated_is_what_was_committed(name):
    assert [each.text() for each in differences(texts_of(name), EXPECTED / name)] == []


def test_the_order_of_session_files_and_where_they_lie_change_nothing(tmp_path):
    """Ledgers are read in the order of their names; here another one comes first, from another folder."""
    lab = tmp_path / "another lab"
    (lab / "sessions").mkdir(parents=True)
    for path in LEDGERS:
        if path.name.startswith("texture_similarity"):
            shutil.copy(path, lab / "sessions")
    assert file_texts(regenerate(Wanted("texture_similarity", lab)), {}) == texts_of("texture_similarity")
